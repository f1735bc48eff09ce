#include "core/detect/refine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>

#include "core/detect/verify.h"

namespace binpose {
namespace {

constexpr float kNormalCosine = 0.7F;
constexpr int kFewestCorrespondences = 12;
/// Weight of staying put, relative to the mean curvature: holds directions that the planes leave free.
constexpr double kDamping = 1e-3;

/// Normal equations of one Gauss-Newton step; unknowns: small rotation about `pivot`, then translation.
struct NormalEquations {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
  int correspondences = 0;
};

NormalEquations linearise(const DepthMap& map, const Model& model, std::span<const std::uint16_t> points,
                          const Eigen::Isometry3f& T_view_model, const Eigen::Vector3f& pivot, float gate) {
  Eigen::Matrix<float, 6, 6> A = Eigen::Matrix<float, 6, 6>::Zero();
  Eigen::Matrix<float, 6, 1> b = Eigen::Matrix<float, 6, 1>::Zero();
  NormalEquations equations;
  for (const std::uint16_t index : points) {
    const SurfacePoint& point = model.surface[index];
    const Eigen::Vector3f p = T_view_model * point.position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0 || !map.has_normal(pixel)) continue;
    const Eigen::Vector3f& normal = map.normals[pixel];
    const Eigen::Vector3f offset = map.points[pixel] - p;
    const float distance = normal.dot(offset);
    if (std::abs(distance) > gate || offset.squaredNorm() > 4 * gate * gate ||
        normal.dot(T_view_model.linear() * point.normal) < kNormalCosine) {
      continue;
    }
    const float relative = distance / gate;
    const float weight = (1 - relative * relative) * (1 - relative * relative);  // Tukey's biweight
    const Eigen::Vector3f turned = (p - pivot).cross(normal);
    const float row[6] = {turned[0], turned[1], turned[2], normal[0], normal[1], normal[2]};
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c <= r; ++c) A(r, c) += weight * row[r] * row[c];
      b(r) += weight * distance * row[r];
    }
    ++equations.correspondences;
  }
  equations.A = Eigen::Matrix<float, 6, 6>(A.selfadjointView<Eigen::Lower>()).cast<double>();
  equations.b = b.cast<double>();
  return equations;
}

}  // namespace

Eigen::Isometry3f refine(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                         const RefineOptions& options) {
  Eigen::Isometry3f T = T_view_model;
  const auto radius = static_cast<float>(0.5 * model.diameter);
  const std::vector<std::uint16_t>& visible = visible_points(model, T);
  const std::span<const std::uint16_t> points(
      visible.data(), std::min<std::size_t>(visible.size(), static_cast<std::size_t>(options.most_points)));
  for (int i = 0; i < options.iterations; ++i) {
    const float progress =
        options.iterations > 1 ? static_cast<float>(i) / static_cast<float>(options.iterations - 1) : 1;
    const float gate = options.first_gate * std::pow(options.last_gate / options.first_gate, progress);
    const Eigen::Vector3f pivot = T * model.centre.cast<float>();
    NormalEquations equations = linearise(map, model, points, T, pivot, gate);
    if (equations.correspondences < kFewestCorrespondences) break;
    // Rotations are damped as what they do at the part's radius.
    const double damping = kDamping * equations.A.diagonal().tail<3>().sum() / 3;
    equations.A.diagonal().head<3>().array() += damping * radius * radius;
    equations.A.diagonal().tail<3>().array() += damping;
    const Eigen::Matrix<float, 6, 1> step = equations.A.ldlt().solve(equations.b).cast<float>();
    if (!step.allFinite()) break;
    const float angle = step.head<3>().norm();
    Eigen::Isometry3f move = Eigen::Isometry3f::Identity();
    if (angle > 1e-9F) move.linear() = Eigen::AngleAxisf(angle, step.head<3>() / angle).toRotationMatrix();
    move.translation() = pivot + step.tail<3>() - move.linear() * pivot;
    T = move * T;
  }
  return T;
}

}  // namespace binpose

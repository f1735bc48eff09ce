#include "core/detect/refine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>

#include "core/detect/point_block.h"
#include "core/detect/verify.h"
#include "core/geometry/pose.h"

namespace binpose {
namespace {

constexpr float kNormalCosine = 0.7F;
constexpr int kFewestCorrespondences = 12;
/// Weight of staying put, relative to the mean curvature: holds directions that the planes leave free.
constexpr double kDamping = 1e-3;
constexpr float kOutwardCosine = 0.7F;
constexpr float kOutlineWeight = 1.0F;

/// Normal equations of one Gauss-Newton step; unknowns: small rotation about the pivot, then translation.
struct NormalEquations {
  float A[6][6] = {};  // lower triangle
  float b[6] = {};
  int rows = 0;

  /// Draws the point at `arm` from the pivot by `distance` along the unit vector `direction`; `gate` is where the pull
  /// of Tukey's biweight ends.
  void add(const Eigen::Vector3f& arm, const Eigen::Vector3f& direction, float distance, float gate, float weight) {
    const float relative = distance / gate;
    weight *= (1 - relative * relative) * (1 - relative * relative);
    const Eigen::Vector3f turned = arm.cross(direction);
    const float row[6] = {turned[0], turned[1], turned[2], direction[0], direction[1], direction[2]};
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c <= r; ++c) A[r][c] += weight * row[r] * row[c];
      b[r] += weight * distance * row[r];
    }
    ++rows;
  }
};

/// Normal equations of eight points at a time.
struct LaneEquations {
  Lanes A[6][6] = {}, b[6] = {}, rows = {};

  [[gnu::always_inline]] void add(const PointBlock& p, const Eigen::Vector3f& pivot, float gate) {
    const LanePoints offset = p.scene_point - p.point;
    const LanePoints& n = p.scene_normal;
    const Lanes distance = dot(n, offset);
    const LaneInts matches = (p.scene_point.z > 0) & (n.z != 0) & (magnitude(distance) <= gate) &
                             (dot(offset, offset) <= 4 * gate * gate) & (dot(n, p.normal) >= kNormalCosine);
    const Lanes zero = {}, relative = distance * (1 / gate), pull = 1 - relative * relative;
    const Lanes weight = matches ? pull * pull : zero;
    const Lanes x = p.point.x - pivot.x(), y = p.point.y - pivot.y(), z = p.point.z - pivot.z();
    const Lanes row[6] = {y * n.z - z * n.y, z * n.x - x * n.z, x * n.y - y * n.x, n.x, n.y, n.z};
    for (int r = 0; r < 6; ++r) {
      const Lanes weighted = weight * row[r];
      for (int c = 0; c <= r; ++c) A[r][c] += weighted * row[c];
      b[r] += weighted * distance;
    }
    rows += matches ? zero + 1 : zero;
  }
};

/// Draws each surface point to the plane of the pixel that it falls on.
BINPOSE_VECTORISED
void add_surface(const DepthMap& map, const Model& model, std::span<const std::uint16_t> points,
                 const Eigen::Isometry3f& T_view_model, const Eigen::Vector3f& pivot, float gate,
                 NormalEquations& equations) {
  LaneEquations sums;
  PointBlock block;
  for (std::size_t first = 0; first < points.size(); first += kLanes) {
    block.load(model.surface, points.subspan(first), T_view_model);
    block.look_up(map);
    sums.add(block, pivot, gate);
  }
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c <= r; ++c) equations.A[r][c] += sum_of(sums.A[r][c]);
    equations.b[r] += sum_of(sums.b[r]);
  }
  equations.rows += static_cast<int>(sum_of(sums.rows));
}

/// The scene's contour nearest to an outline point along its outward direction, or null.
const ContourPoint* matching_contour(const DepthMap& map, const Eigen::Vector3f& p, const Eigen::Vector3f& normal,
                                     const Eigen::Vector3f& outward, float gate) {
  const int reach = std::max(1, static_cast<int>(gate / map.pixel_size));
  for (int k = 0; k <= 2 * reach; ++k) {
    const int step = k % 2 == 0 ? k / 2 : -(k + 1) / 2;
    const Eigen::Vector3f q = p + static_cast<float>(step) * map.pixel_size * outward;
    const int pixel = q.z() > 0 ? map.pixel_of(q) : -1;
    if (pixel < 0 || map.contour_at[pixel] < 0) continue;
    const ContourPoint& contour = map.contours[map.contour_at[pixel]];
    if (contour.outward.dot(outward) > kOutwardCosine && std::abs(normal.dot(contour.position - p)) < gate) {
      return &contour;
    }
  }
  return nullptr;
}

/// Draws each outline point to where the scene's surface ends. Planes leave a flat part free to slide; its rim does
/// not.
void add_outline(const DepthMap& map, const std::vector<ContourPoint>& outline, const Eigen::Isometry3f& T_view_model,
                 const Eigen::Vector3f& pivot, float gate, int stride, NormalEquations& equations) {
  const float weight = kOutlineWeight * static_cast<float>(stride);
  for (std::size_t i = 0; i < outline.size(); i += stride) {
    const ContourPoint& point = outline[i];
    const Eigen::Vector3f p = T_view_model * point.position;
    if (!(p.z() > 0)) continue;
    const Eigen::Vector3f outward = T_view_model.linear() * point.outward;
    const ContourPoint* contour = matching_contour(map, p, T_view_model.linear() * point.normal, outward, gate);
    if (contour == nullptr) continue;
    const float distance = outward.dot(contour->position - p);
    if (std::abs(distance) < gate) equations.add(p - pivot, outward, distance, gate, weight);
  }
}

/// The lower triangle, mirrored.
Matrix6d normal_matrix(const NormalEquations& equations) {
  Matrix6d A;
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c <= r; ++c) A(r, c) = A(c, r) = equations.A[r][c];
  }
  return A;
}

/// The same with translations before rotations.
Matrix6d by_motion(const NormalEquations& equations) {
  const Matrix6d A = normal_matrix(equations);
  Matrix6d swapped;
  swapped << A.bottomRightCorner<3, 3>(), A.bottomLeftCorner<3, 3>(), A.topRightCorner<3, 3>(), A.topLeftCorner<3, 3>();
  return swapped;
}

/// The step that solves the equations, damped; rotations are damped as what they do at the part's radius.
Eigen::Matrix<float, 6, 1> solve(const NormalEquations& equations, float radius) {
  Matrix6d A = normal_matrix(equations);
  Eigen::Matrix<double, 6, 1> b;
  for (int r = 0; r < 6; ++r) b[r] = equations.b[r];
  const double damping = kDamping * A.diagonal().tail<3>().sum() / 3;
  A.diagonal().head<3>().array() += damping * radius * radius;
  A.diagonal().tail<3>().array() += damping;
  return A.ldlt().solve(b).cast<float>();
}

}  // namespace

Eigen::Isometry3f refine(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                         const RefineOptions& options) {
  Eigen::Isometry3f T = T_view_model;
  const auto radius = static_cast<float>(0.5 * model.diameter);
  const int viewpoint = nearest_viewpoint(model, T);
  const std::vector<std::uint16_t>& visible = model.visible_from[viewpoint];
  const std::span<const std::uint16_t> points(
      visible.data(), std::min<std::size_t>(visible.size(), static_cast<std::size_t>(options.most_points)));
  for (int i = 0; i < options.iterations; ++i) {
    const float progress =
        options.iterations > 1 ? static_cast<float>(i) / static_cast<float>(options.iterations - 1) : 1;
    const float gate = options.first_gate * std::pow(options.last_gate / options.first_gate, progress);
    const Eigen::Vector3f pivot = T * model.centre.cast<float>();
    NormalEquations equations;
    add_surface(map, model, points, T, pivot, gate, equations);
    add_outline(map, model.outlines[viewpoint], T, pivot, gate, options.outline_stride, equations);
    if (equations.rows < kFewestCorrespondences) break;
    const Eigen::Matrix<float, 6, 1> step = solve(equations, radius);
    if (!step.allFinite()) break;
    T = Eigen::Translation3f(step.tail<3>()) * turn_about(pivot, rotation_by(step.head<3>())) * T;
  }
  return T;
}

Information information_of(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model, float gate) {
  const int viewpoint = nearest_viewpoint(model, T_view_model);
  const Eigen::Vector3f pivot = T_view_model * model.centre.cast<float>();
  NormalEquations surface, outline;
  add_surface(map, model, model.visible_from[viewpoint], T_view_model, pivot, gate, surface);
  add_outline(map, model.outlines[viewpoint], T_view_model, pivot, gate, 1, outline);
  return {by_motion(surface), by_motion(outline), static_cast<double>(surface.rows)};
}

}  // namespace binpose

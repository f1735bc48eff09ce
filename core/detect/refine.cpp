#include "core/detect/refine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>

#include "core/detect/outline_block.h"
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
};

/// Normal equations of eight points at a time.
struct LaneEquations {
  Lanes A[6][6] = {}, b[6] = {}, rows = {};

  /// Draws the points at `arm` from the pivot by `distance` along the unit vectors `n`, those that have a match; `gate`
  /// is where the pull of Tukey's biweight ends.
  [[gnu::always_inline]] void add(const LanePoints& arm, const LanePoints& n, const Lanes& distance,
                                  const LaneInts& matches, float gate, float most) {
    const Lanes zero = {}, relative = distance * (1 / gate), pull = 1 - relative * relative;
    const Lanes weight = matches ? most * pull * pull : zero;
    const Lanes row[6] = {
        arm.y * n.z - arm.z * n.y, arm.z * n.x - arm.x * n.z, arm.x * n.y - arm.y * n.x, n.x, n.y, n.z};
    for (int r = 0; r < 6; ++r) {
      const Lanes weighted = weight * row[r];
      for (int c = 0; c <= r; ++c) A[r][c] += weighted * row[c];
      b[r] += weighted * distance;
    }
    rows += matches ? zero + 1 : zero;
  }
  void add_to(NormalEquations& equations) const {
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c <= r; ++c) equations.A[r][c] += sum_of(A[r][c]);
      equations.b[r] += sum_of(b[r]);
    }
    equations.rows += static_cast<int>(sum_of(rows));
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
    const LanePoints offset = block.scene_point - block.point;
    const LanePoints& n = block.scene_normal;
    const Lanes distance = dot(n, offset);
    const LaneInts matches = (block.scene_point.z > 0) & (n.z != 0) & (magnitude(distance) <= gate) &
                             (dot(offset, offset) <= 4 * gate * gate) & (dot(n, block.normal) >= kNormalCosine);
    sums.add(block.point - pivot, n, distance, matches, gate, 1);
  }
  sums.add_to(equations);
}

/// How far outward of each outline point of a block the scene's nearest contour along that direction lies; `found` says
/// where there is one.
[[gnu::always_inline]] inline Lanes distance_to_contour(const DepthMap& map, const OutlineBlock& block, float gate,
                                                        LaneInts& found) {
  const int reach = std::max(1, static_cast<int>(gate / map.pixel_size));
  Lanes distance = {};
  LaneInts open = block.point.z > 0;
  for (int k = 0; k <= 2 * reach && bits_of(open) != 0; ++k) {
    const int step = k % 2 == 0 ? k / 2 : -(k + 1) / 2;
    const LaneInts pixel = pixels_of(map, block.moved(static_cast<float>(step) * map.pixel_size));
    for_each_set(open & (pixel >= 0), kLanes, [&](int i) {
      const int at = map.contour_at[pixel[i]];
      if (at < 0) return;
      const ContourPoint& contour = map.contours[at];
      const Eigen::Vector3f outward(block.outward.x[i], block.outward.y[i], block.outward.z[i]);
      const Eigen::Vector3f normal(block.normal.x[i], block.normal.y[i], block.normal.z[i]);
      const Eigen::Vector3f offset =
          contour.position - Eigen::Vector3f(block.point.x[i], block.point.y[i], block.point.z[i]);
      if (!(contour.outward.dot(outward) > kOutwardCosine && std::abs(normal.dot(offset)) < gate)) return;
      distance[i] = outward.dot(offset);
      open[i] = 0;
    });
  }
  found = (block.point.z > 0) & ~open & (magnitude(distance) < gate);
  return distance;
}

/// Draws each outline point to where the scene's surface ends. Planes leave a flat part free to slide; its rim does
/// not.
BINPOSE_VECTORISED
void add_outline(const DepthMap& map, const std::vector<ContourPoint>& outline, const Eigen::Isometry3f& T_view_model,
                 const Eigen::Vector3f& pivot, float gate, int stride, NormalEquations& equations) {
  const float weight = kOutlineWeight * static_cast<float>(stride);
  LaneEquations sums;
  OutlineBlock block;
  for (std::size_t first = 0; first < outline.size(); first += static_cast<std::size_t>(kLanes) * stride) {
    block.load(outline, first, stride, T_view_model);
    LaneInts found;
    const Lanes distance = distance_to_contour(map, block, gate, found);
    sums.add(block.point - pivot, block.outward, distance, found, gate, weight);
  }
  sums.add_to(equations);
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

/// The step that solves the equations.
Eigen::Matrix<float, 6, 1> solve(const NormalEquations& equations, float radius) {
  Twist b;
  for (int r = 0; r < 6; ++r) b[r] = equations.b[r];
  return damped_step(normal_matrix(equations), b, kDamping, radius).cast<float>();
}

}  // namespace

Twist damped_step(Matrix6d A, const Twist& b, double damping, double radius) {
  const double added = damping * A.diagonal().tail<3>().sum() / 3;
  A.diagonal().head<3>().array() += added * radius * radius;
  A.diagonal().tail<3>().array() += added;
  return A.selfadjointView<Eigen::Lower>().ldlt().solve(b);
}

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

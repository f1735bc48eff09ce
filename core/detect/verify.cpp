#include "core/detect/verify.h"

#include <algorithm>
#include <cmath>

#include "core/detect/outline_block.h"
#include "core/detect/point_block.h"

namespace binpose {
namespace {

// See Evidence::score().
constexpr float kViolationPenalty = 4;
constexpr float kExcuse = 0.75F;
constexpr float kMisfitPenalty = 0.75F;
constexpr float kLargeArea = 0.75F;
constexpr float kSizeExponent = 0.45F;
constexpr float kOutlinePenalty = 1.5F;
/// Residual that is no misfit however little the noise, diameters: what the model's sampling leaves, and what a real
/// scanner's calibration bends, which no window of neighbouring pixels shows as noise.
constexpr float kRelativeFloor = 0.002F;
/// What is known of an outline before it is looked at, as if so large a share of it had been found right or wrong: it
/// may all be hidden.
constexpr float kOutlineTrust = 0.01F, kOutlineDoubt = 0.08F;
/// Pixels up to which outlines are judged in full, diameters.
constexpr float kFinePixel = 0.021F;
/// How far outside of the outline the surface must have ended, and how far inside it must still be there, pixels.
constexpr float kOutside = 2.0F;
constexpr float kInside = 1.0F;

/// How far the scene lies behind the surface carried on by `distance` along `outward`, metres; `measured` says where
/// that is known. At a rounded side the tangent plane runs along the ray: it is carried on at most at `steepest`.
[[gnu::always_inline]] inline Lanes depth_behind(const DepthMap& map, const OutlineBlock& b, float distance,
                                                 float steepest, LaneInts& measured) {
  const LaneInts pixel = pixels_of(map, b.moved(distance));
  Lanes depth = {};
  for (int i = 0; i < kLanes; ++i) depth[i] = map.pixels[std::max(0, pixel[i])].position.z();
  measured = (pixel >= 0) & (depth > 0) & (b.point.z > 0);
  const Lanes zero = {}, one = zero + 1;
  const Lanes towards = -b.normal.z > 0.05F ? -b.normal.z : zero + 0.05F;
  Lanes slope = dot(b.normal, b.outward) / towards;
  slope = slope > steepest ? zero + steepest : slope;
  slope = slope < -steepest ? zero - steepest : slope;
  return (depth - b.point.z - slope * distance) / root(one + slope * slope);
}

/// Whether the scene's surface ends where the model's does.
BINPOSE_VECTORISED
void check_outline(const DepthMap& map, const std::vector<ContourPoint>& outline, const Eigen::Isometry3f& T_view_model,
                   const VerifyOptions& options, Evidence& evidence) {
  LaneInts confirmed = {}, contradicted = {};
  const auto stride = static_cast<std::size_t>(options.outline_stride);
  OutlineBlock block;
  for (std::size_t first = 0; first < outline.size(); first += kLanes * stride) {
    block.load(outline, first, options.outline_stride, T_view_model);
    LaneInts known_inside, known_outside;
    const Lanes inside = depth_behind(map, block, -kInside * map.pixel_size, 5, known_inside);
    const Lanes outside = depth_behind(map, block, kOutside * map.pixel_size, 1, known_outside);
    const LaneInts missing = known_inside & (inside > options.tolerance);
    const LaneInts hidden = known_inside & (inside < -options.tolerance);
    const LaneInts judged = ~hidden & ~missing;
    // Sensors see little past an edge: a surface that is measured up to it and not beyond ends there as far as they
    // tell.
    confirmed -= judged & ((known_outside & (outside > options.tolerance)) | (known_inside & ~known_outside));
    contradicted -= missing | (judged & known_outside & (magnitude(outside) <= options.tolerance));
  }
  const float scale =
      static_cast<float>(options.outline_stride) / static_cast<float>(std::max<std::size_t>(1, outline.size()));
  evidence.outline_confirmed = scale * static_cast<float>(sum_of(confirmed));
  evidence.outline_contradicted = scale * static_cast<float>(sum_of(contradicted));
}

/// 1 for the points of a block whose pixel is still there to be explained, 0 for the others.
[[gnu::always_inline]] inline Lanes find_free(const DepthMap& map, const std::vector<int>* owner,
                                              const PointBlock& block) {
  Lanes free = {};
  for (int i = 0; i < kLanes; ++i) {
    const int at = std::max(0, block.pixel[i]);
    free[i] = map.background[at] != 0 || (owner != nullptr && (*owner)[at] >= 0) ? 0.0F : 1.0F;
  }
  return free;
}

/// Sums over points by what the sensor saw of them, each weighed by its area across the ray.
struct SurfaceSums {
  Lanes total = {}, explained = {}, sq_distance = {}, violated = {}, occluded = {}, unexplained = {};

  [[gnu::always_inline]] void add(const PointBlock& b, const Lanes& free, float tolerance, float slack,
                                  float normal_cosine) {
    const Lanes zero = {};
    const Lanes facing = -dot(b.normal, b.point) / root(dot(b.point, b.point));
    const Lanes weight = ((b.point.z > 0) & (facing >= kSteepest)) ? facing : zero;
    const Lanes judged = b.scene_point.z > 0 ? weight : zero;
    const Lanes distance = dot(b.normal, b.scene_point - b.point);
    const Lanes step = b.scene_point.z - b.point.z;
    // A depth step of a slanted surface within a pixel is no contradiction.
    const Lanes at = ((magnitude(distance) <= tolerance) & (magnitude(step) < 3 * slack)) ? judged : zero;
    const Lanes same = ((b.scene_normal.z != 0) & (dot(b.normal, b.scene_normal) >= normal_cosine)) ? at * free : zero;
    const Lanes off = judged - at;
    const Lanes behind = step > slack ? off : zero, before = step < -slack ? off : zero;
    total += weight;
    explained += same;
    sq_distance += same * distance * distance;
    violated += behind;
    occluded += before;
    unexplained += judged - same - behind - before;
  }
};

BINPOSE_VECTORISED
Evidence compare_surface(const DepthMap& map, const Model& model, std::span<const std::uint16_t> points,
                         const Eigen::Isometry3f& T_view_model, const VerifyOptions& options,
                         const std::vector<int>* owner) {
  SurfaceSums sums;
  PointBlock block;
  const float slack = options.tolerance + 1.5F * map.pixel_size;
  for (std::size_t first = 0; first < points.size(); first += kLanes) {
    block.load(model.surface, points.subspan(first), T_view_model);
    block.look_up(map);
    sums.add(block, find_free(map, owner, block), options.tolerance, slack, options.normal_cosine);
  }
  const float scale = 1 / std::max(sum_of(sums.total), 1e-6F);
  Evidence evidence;
  const float explained = sum_of(sums.explained);
  evidence.residual = explained > 0 ? std::sqrt(sum_of(sums.sq_distance) / explained) : 0;
  evidence.explained = scale * explained;
  evidence.violated = scale * sum_of(sums.violated);
  evidence.occluded = scale * sum_of(sums.occluded);
  evidence.unexplained = scale * sum_of(sums.unexplained);
  return evidence;
}

/// A prefix of the surface points is evenly spread; this many tell poses apart.
constexpr std::size_t kAlignedPoints = 500;

}  // namespace

float Evidence::score_with_outline(float weight) const {
  const float surface = (explained - kViolationPenalty * violated) / (1 - kExcuse * occluded);
  const float right = outline_confirmed + kOutlineTrust, wrong = kOutlinePenalty * outline_contradicted + kOutlineDoubt;
  const float outline = std::pow(right / (right + wrong), weight);
  const float fit = std::exp(-kMisfitPenalty * std::max(0.0F, relative_residual - 1));
  const float size = std::pow(std::min(1.0F, area / kLargeArea), kSizeExponent);
  return std::clamp(surface * outline * fit * size, 0.0F, 1.0F);
}

float Evidence::promise() const {
  constexpr float kPenalty = 0.5F, kOutlineShare = 0.5F, kUnknown = 0.05F;
  const float surface = (explained - kPenalty * violated) / (1 - kExcuse * occluded);
  const float confirmed = outline_confirmed + kUnknown, contradicted = outline_contradicted + kUnknown;
  return surface + kOutlineShare * confirmed / (confirmed + contradicted);
}

float alignment_score(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model, float cutoff) {
  const std::size_t count = std::min<std::size_t>(kAlignedPoints, model.surface.size());
  float sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f p = T_view_model * model.surface[i].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    const bool measured = pixel >= 0 && map.measured(pixel);
    sum += measured ? std::min(cutoff, (map.pixels[pixel].position - p).norm()) : cutoff;
  }
  return 1 - sum / (cutoff * static_cast<float>(std::max<std::size_t>(1, count)));
}

int nearest_viewpoint(const Model& model, const Eigen::Isometry3f& T_view_model) {
  const Eigen::Vector3f centre = T_view_model * model.centre.cast<float>();
  const Eigen::Vector3f towards_viewer = T_view_model.linear().transpose() * -centre;
  return nearest_view(model.viewpoints, towards_viewer);
}

Evidence verify(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                const VerifyOptions& options, const std::vector<int>* owner) {
  const int viewpoint = nearest_viewpoint(model, T_view_model);
  const std::vector<std::uint16_t>& visible = model.visible_from[viewpoint];
  const std::size_t count = std::min<std::size_t>(options.most_points, visible.size());
  Evidence evidence = compare_surface(map, model, {visible.data(), count}, T_view_model, options, owner);
  evidence.relative_residual =
      evidence.residual / std::max(map.noise, kRelativeFloor * static_cast<float>(model.diameter));
  const float fineness = std::min(1.0F, kFinePixel * static_cast<float>(model.diameter) / map.pixel_size);
  evidence.outline_weight = fineness * fineness;
  evidence.area = evidence.explained * model.view_area[viewpoint];
  check_outline(map, model.outlines[viewpoint], T_view_model, options, evidence);
  return evidence;
}

}  // namespace binpose

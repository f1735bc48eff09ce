#include "core/detect/variants.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/detect/point_block.h"

namespace binpose {
namespace {

/// Measured in front by less than this share of the diameter: not another part that hides the point, but this one, in
/// another pose.
constexpr float kOwnDepth = 0.08F;
/// Log of the odds that one pixel adds to the variant that it fits; neighbouring pixels repeat each other.
constexpr float kPixelWeight = 0.28F;
/// Rivals less likely than this against the choice are ruled out.
constexpr float kRuledOut = 0.05F;

/// What the telling points say for a pose: those that the scene has less those that it contradicts, in pixels.
BINPOSE_VECTORISED
float telling_evidence(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                       const VerifyOptions& options) {
  const std::span<const std::uint16_t> points = model.telling_from[nearest_viewpoint(model, T_view_model)];
  const float own_depth = kOwnDepth * static_cast<float>(model.diameter);
  const Lanes zero = {};
  Lanes sum = zero;
  PointBlock block;
  for (std::size_t first = 0; first < points.size(); first += kLanes) {
    block.load(model.telling_points, points.subspan(first), T_view_model);
    block.look_up(map);
    const Lanes distance = dot(block.normal, block.scene_point - block.point);
    const LaneInts judged =
        (block.point.z > 0) & (block.scene_point.z > 0) & (block.scene_point.z >= block.point.z - own_depth);
    const Lanes cosine = -dot(block.normal, block.point) / root(dot(block.point, block.point));
    const Lanes facing = (judged & (cosine > 0)) ? cosine : zero;
    sum += magnitude(distance) <= options.tolerance ? facing : -facing;
  }
  const float spacing = model.telling_spacing / map.pixel_size;
  return sum_of(sum) * std::min(1.0F, spacing * spacing);
}

}  // namespace

VariantChoice choose_variant(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                             const VerifyOptions& options,
                             const std::function<bool(const Eigen::Isometry3f&)>& allowed) {
  VariantChoice choice{T_view_model, 1, {}};
  if (model.similar_poses.empty()) return choice;
  std::vector<Eigen::Isometry3f> poses = {T_view_model};
  for (const Pose& T_model_model : model.similar_poses) {
    const Eigen::Isometry3f variant = T_view_model * T_model_model.cast<float>();
    if (allowed(variant)) poses.push_back(variant);
  }
  std::vector<float> evidence;
  evidence.reserve(poses.size());
  for (const Eigen::Isometry3f& pose : poses) evidence.push_back(telling_evidence(map, model, pose, options));
  const auto best = std::max_element(evidence.begin(), evidence.end());
  float odds = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const float likelihood = std::exp(kPixelWeight * (evidence[i] - *best));
    odds += likelihood;
    if (evidence.begin() + static_cast<std::ptrdiff_t>(i) != best && likelihood > kRuledOut) {
      choice.rivals.push_back(poses[i]);
    }
  }
  choice.T_view_model = poses[best - evidence.begin()];
  choice.confidence = 1 / odds;
  return choice;
}

}  // namespace binpose

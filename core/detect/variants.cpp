#include "core/detect/variants.h"

#include <algorithm>
#include <span>

#include "core/detect/places.h"
#include "core/detect/telling.h"

namespace binpose {
namespace {

/// What the telling points say for a pose: those that the scene has less those that it contradicts.
BINPOSE_VECTORISED
float telling_evidence(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                       const VerifyOptions& options) {
  const std::span<const std::uint16_t> points = model.telling_from[nearest_viewpoint(model, T_view_model)];
  Lanes sum = {};
  PointBlock block;
  for (std::size_t first = 0; first < points.size(); first += kLanes) {
    block.load(model.telling_points, points.subspan(first), T_view_model);
    block.look_up(map);
    sum += telling_weights(block, 0, options.tolerance, static_cast<float>(model.diameter));
  }
  return sum_of(sum);
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
  choice.T_view_model = poses[best - evidence.begin()];
  const float spacing = static_cast<float>(model.telling_spacing) / map.pixel_size;
  float right = 0, odds = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const float likelihood = likelihood_ratio(evidence[i] - *best, spacing);
    odds += likelihood;
    if (likelihood <= kRuledOut) continue;
    if (same_pose(model, poses[i], choice.T_view_model)) {
      right += likelihood;
    } else {
      choice.rivals.push_back(poses[i]);
    }
  }
  choice.confidence = right / odds;
  return choice;
}

}  // namespace binpose

#include "core/detect/variants.h"

#include <algorithm>
#include <cmath>

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
float telling_evidence(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                       const VerifyOptions& options) {
  const int viewpoint = nearest_viewpoint(model, T_view_model);
  const float own_depth = kOwnDepth * static_cast<float>(model.diameter);
  float sum = 0;
  for (std::size_t i = 0; i < model.telling_points.size(); ++i) {
    if (!sees(model.telling_visibility[i], viewpoint)) continue;
    const Eigen::Vector3f p = T_view_model * model.telling_points[i].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0 || !map.measured(pixel)) continue;
    const Eigen::Vector3f normal = T_view_model.linear() * model.telling_points[i].normal;
    const float distance = normal.dot(map.pixels[pixel].position - p);
    if (map.pixels[pixel].position.z() < p.z() - own_depth) continue;
    const float facing = std::max(0.0F, -normal.dot(p) / p.norm());
    sum += std::abs(distance) <= options.tolerance ? facing : -facing;
  }
  const float spacing = model.telling_spacing / map.pixel_size;
  return sum * std::min(1.0F, spacing * spacing);
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

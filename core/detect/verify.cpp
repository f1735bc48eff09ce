#include "core/detect/verify.h"

#include <algorithm>
#include <cmath>

namespace binpose {
namespace {

/// What a point in free space takes away, against what an explained one adds.
constexpr float kViolationPenalty = 1.0F;

}  // namespace

float Evidence::score() const { return std::clamp(explained - kViolationPenalty * violated, 0.0F, 1.0F); }

const std::vector<std::uint16_t>& visible_points(const Model& model, const Eigen::Isometry3f& T_view_model) {
  const Eigen::Vector3f centre = T_view_model * model.centre.cast<float>();
  const Eigen::Vector3f towards_viewer = T_view_model.linear().transpose() * -centre;
  return model.visible_from[nearest_view(model.viewpoints, towards_viewer)];
}

Evidence verify(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                const VerifyOptions& options, const std::vector<std::uint8_t>* owned) {
  const std::vector<std::uint16_t>& visible = visible_points(model, T_view_model);
  const int count = std::min(options.most_points, static_cast<int>(visible.size()));
  int explained = 0, violated = 0, occluded = 0, unexplained = 0;
  float sum_sq = 0;
  for (int i = 0; i < count; ++i) {
    const SurfacePoint& point = model.surface[visible[i]];
    const Eigen::Vector3f p = T_view_model * point.position;
    if (!(p.z() > 0)) continue;
    const int pixel = map.pixel_of(p);
    if (pixel < 0 || !map.measured(pixel)) continue;
    const Eigen::Vector3f normal = T_view_model.linear() * point.normal;
    const float distance = normal.dot(map.points[pixel] - p);
    const float depth_step = map.points[pixel].z() - p.z();
    const bool taken = owned != nullptr && (*owned)[pixel] != 0;
    // A depth step of a slanted surface within a pixel is no contradiction.
    const float slack = options.tolerance + 1.5F * map.pixel_size;
    if (std::abs(distance) <= options.tolerance && std::abs(depth_step) < 3 * slack) {
      if (!taken && map.has_normal(pixel) && normal.dot(map.normals[pixel]) >= options.normal_cosine) {
        ++explained;
        sum_sq += distance * distance;
      } else {
        ++unexplained;
      }
    } else if (depth_step > slack) {
      ++violated;
    } else if (depth_step < -slack) {
      ++occluded;
    } else {
      ++unexplained;
    }
  }
  Evidence evidence;
  const float scale = 1.0F / static_cast<float>(std::max(1, count));
  evidence.explained = scale * static_cast<float>(explained);
  evidence.violated = scale * static_cast<float>(violated);
  evidence.occluded = scale * static_cast<float>(occluded);
  evidence.unexplained = scale * static_cast<float>(unexplained);
  evidence.residual = explained > 0 ? std::sqrt(sum_sq / static_cast<float>(explained)) : 0;
  return evidence;
}

}  // namespace binpose

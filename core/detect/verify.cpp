#include "core/detect/verify.h"

#include <algorithm>
#include <cmath>

namespace binpose {
namespace {

/// What a point in free space takes away, against what an explained one adds.
constexpr float kViolationPenalty = 1.0F;
/// Outline points, as a share, that are taken for granted on either side: what an outline that is hidden counts.
constexpr float kOutlinePrior = 0.02F;
/// Surface seen under less than this cosine (75 degrees) is left out: sensors often get no echo from it.
constexpr float kSteepest = 0.25882F;
/// How far outside of the outline the surface must have ended, and how far inside it must still be there, pixels.
constexpr float kOutside = 2.0F;
constexpr float kInside = 1.0F;

/// How far the scene lies behind the surface of an outline point, carried on a little along `outward`; metres, NaN
/// where nothing was measured. At a rounded side the tangent plane runs along the ray: it is carried on at most at
/// `steepest`.
float depth_behind(const DepthMap& map, const Eigen::Vector3f& p, const Eigen::Vector3f& normal,
                   const Eigen::Vector3f& outward, float distance, float steepest) {
  const Eigen::Vector3f q = p + distance * outward;
  const int pixel = q.z() > 0 ? map.pixel_of(q) : -1;
  if (pixel < 0 || !map.measured(pixel)) return NAN;
  const float slope = std::clamp(normal.dot(outward) / std::max(-normal.z(), 0.05F), -steepest, steepest);
  return (map.points[pixel].z() - p.z() - slope * distance) / std::sqrt(1 + slope * slope);
}

/// Whether the scene's surface ends where the model's does.
void check_outline(const DepthMap& map, const std::vector<ContourPoint>& outline, const Eigen::Isometry3f& T_view_model,
                   const VerifyOptions& options, Evidence& evidence) {
  int confirmed = 0, contradicted = 0;
  for (const ContourPoint& contour : outline) {
    const Eigen::Vector3f p = T_view_model * contour.position;
    const Eigen::Vector3f normal = T_view_model.linear() * contour.normal;
    const Eigen::Vector3f outward = T_view_model.linear() * contour.outward;
    const float inside = depth_behind(map, p, normal, outward, -kInside * map.pixel_size, 5);
    if (inside < -options.tolerance) continue;  // hidden
    const float outside = depth_behind(map, p, normal, outward, kOutside * map.pixel_size, 1);
    if (inside > options.tolerance) {
      ++contradicted;
    } else if (outside > options.tolerance) {
      ++confirmed;
    } else if (outside >= -options.tolerance) {
      ++contradicted;
    }
  }
  const float scale = 1.0F / static_cast<float>(std::max<std::size_t>(1, outline.size()));
  evidence.outline_confirmed = scale * static_cast<float>(confirmed);
  evidence.outline_contradicted = scale * static_cast<float>(contradicted);
}

/// A prefix of the surface points is evenly spread; this many tell poses apart.
constexpr std::size_t kAlignedPoints = 500;

}  // namespace

float Evidence::score() const {
  // What is hidden half excuses itself.
  const float surface = (explained - kViolationPenalty * violated) / (1 - 0.5F * occluded);
  const float outline =
      (outline_confirmed + kOutlinePrior) / (outline_confirmed + outline_contradicted + 2 * kOutlinePrior);
  return std::clamp(surface * outline, 0.0F, 1.0F);
}

float alignment_score(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model, float cutoff) {
  const std::size_t count = std::min<std::size_t>(kAlignedPoints, model.surface.size());
  float sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f p = T_view_model * model.surface[i].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    const bool measured = pixel >= 0 && map.measured(pixel);
    sum += measured ? std::min(cutoff, (map.points[pixel] - p).norm()) : cutoff;
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
  const int count = std::min(options.most_points, static_cast<int>(visible.size()));
  Evidence evidence;
  float total = 0, sum_sq = 0;
  for (int i = 0; i < count; ++i) {
    const SurfacePoint& point = model.surface[visible[i]];
    const Eigen::Vector3f p = T_view_model * point.position;
    if (!(p.z() > 0)) continue;
    const Eigen::Vector3f normal = T_view_model.linear() * point.normal;
    const float weight = -normal.dot(p) / p.norm();
    if (weight < kSteepest) continue;
    total += weight;
    const int pixel = map.pixel_of(p);
    if (pixel < 0 || !map.measured(pixel)) continue;
    const float distance = normal.dot(map.points[pixel] - p);
    const float depth_step = map.points[pixel].z() - p.z();
    const bool taken = map.background[pixel] != 0 || (owner != nullptr && (*owner)[pixel] >= 0);
    // A depth step of a slanted surface within a pixel is no contradiction.
    const float slack = options.tolerance + 1.5F * map.pixel_size;
    if (std::abs(distance) <= options.tolerance && std::abs(depth_step) < 3 * slack) {
      if (!taken && map.has_normal(pixel) && normal.dot(map.normals[pixel]) >= options.normal_cosine) {
        evidence.explained += weight;
        sum_sq += weight * distance * distance;
      } else {
        evidence.unexplained += weight;
      }
    } else if (depth_step > slack) {
      evidence.violated += weight;
    } else if (depth_step < -slack) {
      evidence.occluded += weight;
    } else {
      evidence.unexplained += weight;
    }
  }
  evidence.residual = evidence.explained > 0 ? std::sqrt(sum_sq / evidence.explained) : 0;
  const float scale = 1 / std::max(total, 1e-6F);
  for (float* share : {&evidence.explained, &evidence.violated, &evidence.occluded, &evidence.unexplained}) {
    *share *= scale;
  }
  check_outline(map, model.outlines[viewpoint], T_view_model, options, evidence);
  return evidence;
}

}  // namespace binpose

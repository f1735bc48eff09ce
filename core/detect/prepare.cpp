#include "core/detect/prepare.h"

#include <algorithm>

#include "core/detect/background.h"
#include "core/detect/support_plane.h"
#include "core/geometry/contours.h"
#include "core/geometry/normals.h"

namespace binpose {
namespace {

constexpr double kRelativePixel = 0.014;
constexpr double kPixelPerSpacing = 1.2;
constexpr float kContourStep = 0.03F;

/// Normals from the smallest windows that the noise allows: wide ones blur small faces.
void estimate_steady_normals(DepthMap& map, const RunControl& control) {
  constexpr int kWidest = 3;
  constexpr double kNormalError = 4 * kDegree;
  std::vector<float> deviations = estimate_normals(map, 1, control);
  const float noise = map.noise;
  int radius = 1;
  while (radius < kWidest && normal_error(noise, map.pixel_size, radius) > kNormalError) ++radius;
  if (radius > 1) {
    deviations = estimate_normals(map, radius, control);
    map.noise = noise;
  }
  sharpen_normals(map, deviations, radius, control);
}

}  // namespace

DepthMap prepare(const SensorView& view, const Model& model, const DetectParams& params, const RunControl& control) {
  DepthMap map = depth_map(view, std::max(kRelativePixel * model.diameter, kPixelPerSpacing * view.spacing), control);
  if (view.normals.empty()) estimate_steady_normals(map, control);
  if (control.interrupted()) return map;
  const bool is_background_known = params.space.support_plane || params.space.bin_interior;
  if (params.remove_support_plane && !is_background_known) mark_support_plane(map, static_cast<float>(model.diameter));
  mark_outside(map, params.space, model.diameter);
  find_contours(map, kContourStep * static_cast<float>(model.diameter), Unmeasured::kUnknown, control);
  return map;
}

}  // namespace binpose

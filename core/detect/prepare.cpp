#include "core/detect/prepare.h"

#include <algorithm>
#include <cmath>

#include "core/detect/background.h"
#include "core/detect/support_plane.h"
#include "core/geometry/contours.h"
#include "core/geometry/hidden_surfaces.h"
#include "core/geometry/normals.h"

namespace binpose {
namespace {

constexpr double kRelativePixel = 0.014;
constexpr double kPixelPerSpacing = 1.2;  // of scattered points, else too many pixels stay empty
constexpr double kMostHidden = 0.12;      // of one sensor's points, behind others
constexpr float kContourStep = 0.03F;

/// Its pixels are as large as the points' spacing asks for, if the part's size does not ask for larger ones.
DepthMap map_of(const SensorView& view, double diameter, const RunControl& control) {
  const double least = kRelativePixel * diameter;
  if (view.is_grid) return depth_map(view, std::max<double>(least, view.spacing), control);
  DepthMap map = depth_map(view, std::max(least, kPixelPerSpacing * view.spacing), control);
  const double hidden = hidden_share(view, map);
  if (hidden > kMostHidden) {
    map = depth_map(view, std::max(least, kPixelPerSpacing * view.spacing / std::sqrt(1 - hidden)), control);
    hide_behind_gaps(map, control);
    map.hides_points = true;
  }
  return map;
}

/// Normals from the smallest windows that the noise allows: wide ones blur small faces.
void estimate_steady_normals(DepthMap& map, const RunControl& control) {
  constexpr int kWidest = 3;
  constexpr double kNormalError = 4 * kDegree;
  WindowPlanes planes = estimate_normals(map, 1, control);
  const float noise = map.noise;
  int radius = 1;
  while (radius < kWidest && normal_error(noise, map.pixel_size, radius) > kNormalError) ++radius;
  if (radius > 1) {
    planes = estimate_normals(map, radius, control);
    map.noise = noise;
  }
  sharpen_normals(map, planes, control);
}

}  // namespace

DepthMap prepare(const SensorView& view, const Model& model, const DetectParams& params, const RunControl& control) {
  DepthMap map = map_of(view, model.diameter, control);
  if (view.normals.empty()) estimate_steady_normals(map, control);
  if (control.interrupted()) return map;
  const bool is_background_known = params.space.support_plane || params.space.bin_interior;
  if (params.remove_support_plane && !is_background_known) mark_support_plane(map, static_cast<float>(model.diameter));
  mark_outside(map, params.space, model.diameter);
  find_contours(map, kContourStep * static_cast<float>(model.diameter), Unmeasured::kUnknown, control);
  return map;
}

}  // namespace binpose

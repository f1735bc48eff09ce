#pragma once

#include <vector>

#include "core/geometry/depth_map.h"
#include "core/run_control.h"

namespace binpose {

/// Surface seen under a smaller cosine (80 degrees off the ray) counts as not seen.
constexpr float kGrazingCosine = 0.17364818F;

/// Where pixels are in arrays with a margin of the windows' radius around the image, and room to read eight at once.
struct MarginLayout {
  int radius, stride;
  std::size_t size;

  MarginLayout(const DepthMap& map, int radius);
  std::size_t at(int u, int v) const { return static_cast<std::size_t>(v + radius) * stride + u + radius; }
};

/// The planes through the windows around pixels, normal . point = offset, view frame; one array each.
struct WindowPlanes : MarginLayout {
  std::vector<float> normal_x, normal_y, normal_z;  ///< zero: not known
  std::vector<float> offset;                        ///< metres
  std::vector<float> deviation;  ///< standard deviation of the window's points from it, metres; infinite: not known

  /// None is known.
  WindowPlanes(const DepthMap& map, int radius);
  Eigen::Vector3f normal(std::size_t i) const { return {normal_x[i], normal_y[i], normal_z[i]}; }
};

/// Sets the normal of every measured pixel that has enough neighbours: the plane through its window, fitted as inverse
/// depth over the image, where every plane is linear. Neighbours across a depth step are left out; pixels seen under
/// more than 80 degrees get no normal. Also sets the map's noise, from the windows that are most nearly plane.
///
/// @param radius  of the window, pixels: 1 = 3 x 3.
/// Deterministic on any number of threads. Ends early, with pixels left out, when `control` interrupts.
WindowPlanes estimate_normals(DepthMap& map, int radius, const RunControl& control = {});

/// Gives a pixel the normal of the quietest window that holds it, where that is much quieter than its own (or it has
/// none) and the pixel lies on its plane: a window across an edge averages two surfaces, one beside it sees but one.
///
/// @param planes  as estimate_normals() returned them.
/// Deterministic on any number of threads. Does nothing when `control` interrupts.
void sharpen_normals(DepthMap& map, const WindowPlanes& planes, const RunControl& control = {});

/// Standard deviation of a normal about one axis that a plane fit over a window leaves, radians; lengths in metres.
double normal_error(double noise, double pixel_size, int radius);

}  // namespace binpose

#pragma once

#include "core/geometry/depth_map.h"
#include "core/run_control.h"

namespace binpose {

/// What lies beyond the pixels that were not measured.
enum class Unmeasured {
  kUnknown,  ///< a scan: shadows and drop-outs prove nothing
  kFar,      ///< a rendering: nothing there
};

/// Sets the contour points of a map, row by row.
///
/// A measured pixel with a normal, not of the background, is one when, in some of the 8 directions, the next measured
/// pixel (over gaps of a few pixels) lies more than `step` behind its tangent plane. Nearer neighbours are occluders,
/// not ends of the surface.
/// @param step  metres.
/// Ends early, with points left out, when `control` interrupts.
void find_contours(DepthMap& map, float step, Unmeasured unmeasured, const RunControl& control = {});

}  // namespace binpose

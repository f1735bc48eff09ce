#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/geometry/depth_map.h"
#include "core/run_control.h"
#include "core/vector_pair.h"

namespace binpose {

/// The model as each viewpoint sees it: contour points, in the model frame, found in a rendering of the dense points by
/// the same rule as in a scan.
///
/// @param dense       the surface, spaced at most half a pixel.
/// @param viewpoints  unit directions from the part to the viewer.
/// @param diameter    of the part, metres; the viewer is far away against it.
/// @param pixel       of the rendering, metres.
/// @param step        depth step that makes a contour, metres.
/// Deterministic on any number of threads. Views are empty when `control` interrupts.
std::vector<std::vector<ContourPoint>> outlines(std::span<const SurfacePoint> dense,
                                                std::span<const Eigen::Vector3f> viewpoints, double diameter,
                                                double pixel, double step, const RunControl& control);

}  // namespace binpose

#pragma once

#include "core/geometry/depth_map.h"

namespace binpose {

/// Marks the pixels of the plane that the parts lie on, such as a table or the floor of a bin, as background: they give
/// no pairs and explain no pose.
///
/// Conservative, as a plane taken for the floor hides parts: it must hold a tenth of the measured pixels, be at least
/// two diameters wide and long, and have next to nothing behind it. Deterministic.
/// @param diameter  of the part, metres.
/// @return          whether there is such a plane.
bool mark_support_plane(DepthMap& map, float diameter);

/// How far from a plane a pixel counts as its own, metres.
float plane_tolerance(const DepthMap& map, float diameter);

}  // namespace binpose

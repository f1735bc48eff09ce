#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/run_control.h"
#include "core/vector_pair.h"

namespace binpose {

/// Points spread over the surface in proportion to area, about one per `spacing` squared, each with the outward normal
/// of its triangle, evenly also where triangles are long slivers. Triangles without area get none. Part of them when
/// `control` interrupts.
///
/// @param triangle_of  if given: is filled with the triangle of each point.
std::vector<SurfacePoint> scatter(const Mesh& mesh, double spacing, const RunControl& control = {},
                                  std::vector<std::uint32_t>* triangle_of = nullptr);

/// Thins points to an even spread: no two on the same side of the surface are nearer than `distance`, and no point of
/// `dense` is farther from a kept one. Progressive: every prefix of the result is evenly spread too, ever finer.
/// Two sides of a thin sheet (normals more than 60 degrees apart) are thinned each for itself. Part of them when
/// `control` interrupts.
std::vector<SurfacePoint> thin_evenly(const std::vector<SurfacePoint>& dense, double distance,
                                      const RunControl& control = {});

}  // namespace binpose

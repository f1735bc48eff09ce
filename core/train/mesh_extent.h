#pragma once

#include <Eigen/Core>

#include "absl/status/status.h"
#include "core/geometry/mesh.h"
#include "core/run_control.h"

namespace binpose {

/// Size of a mesh, metres.
struct MeshExtent {
  Eigen::Vector3d box_min, box_max;
  double diameter = 0;  ///< largest distance between two vertices that triangles use, to 0.15 %
  double area = 0;      ///< square metres
};

/// OK, or INVALID_ARGUMENT saying why nothing can be trained from this mesh: no triangles, an index out of range, a
/// coordinate that is not finite or far off, next to no area or far too much, or an extent outside [1 um, 10 km]; or
/// what `control` says.
absl::Status check_mesh(const Mesh& mesh, const RunControl& control = {});

/// Extent of a mesh that check_mesh() accepts; of part of it when `control` interrupts.
MeshExtent mesh_extent(const Mesh& mesh, const RunControl& control = {});

}  // namespace binpose

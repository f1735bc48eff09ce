#pragma once

#include <Eigen/Core>

#include "absl/status/status.h"
#include "core/geometry/mesh.h"

namespace binpose {

/// Size of a mesh, metres.
struct MeshExtent {
  Eigen::Vector3d box_min, box_max;
  double diameter = 0;  ///< largest distance between two vertices that triangles use, to 0.15 %
  double area = 0;      ///< square metres
};

/// OK, or INVALID_ARGUMENT saying why nothing can be trained from this mesh: no triangles, an index out of range, a
/// coordinate that is not finite, next to no area, or an extent outside [1 um, 10 km].
absl::Status check_mesh(const Mesh& mesh);

/// Extent of a mesh that check_mesh() accepts.
MeshExtent mesh_extent(const Mesh& mesh);

}  // namespace binpose

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/mesh.h"
#include "core/run_control.h"

namespace binpose {

/// What a mesh file says, in its own unit: faces with any number of corners, nothing checked yet.
struct PolygonMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::uint8_t> corner_counts;  ///< per face
  std::vector<std::uint32_t> corners;       ///< indices into `vertices`, face after face
};

/// Most corners that a face may have.
inline constexpr std::size_t kMaxCorners = 255;

/// Checks the polygons and cuts them into triangles; merges vertices of equal coordinates and drops those that no
/// face uses. Triangles without area are kept.
///
/// @param scale  of the coordinates, for example 0.001 metres per unit.
/// Errors: INVALID_ARGUMENT (no face; a coordinate that is not finite; a face with fewer than 3 corners, with a vertex
/// that does not exist, or that no fan of triangles can fill), RESOURCE_EXHAUSTED (more than `max_triangles`); or what
/// `control` says.
absl::StatusOr<Mesh> triangulate(const PolygonMesh& polygons, double scale, std::size_t max_triangles,
                                 const RunControl& control = {});

}  // namespace binpose

#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"
#include "core/io/polygon_mesh.h"
#include "core/run_control.h"

namespace binpose {

/// Reads the vertices and faces of a PLY file (ASCII or binary of either byte order); other elements are skipped.
///
/// @param bytes  hostile.
/// Errors: INVALID_ARGUMENT (truncated, x y z missing, a face index that is no whole number), RESOURCE_EXHAUSTED (more
/// faces than `max_triangles`, or more than three times as many vertices); or what `control` says.
absl::StatusOr<PolygonMesh> read_ply_mesh(std::string_view bytes, std::size_t max_triangles,
                                          const RunControl& control = {});

/// Reads the vertices of a PLY file as an unordered cloud: x y z and, if there, nx ny nz.
///
/// @param bytes            the file; hostile. NaN in x, y or z: no measurement.
/// @param metres_per_unit  1 or 0.001.
/// Errors: INVALID_ARGUMENT (truncated, x y z missing), RESOURCE_EXHAUSTED (more than `max_points`); or what `control`
/// says.
absl::StatusOr<PointCloud> read_ply_cloud(std::string_view bytes, double metres_per_unit, std::size_t max_points,
                                          const RunControl& control = {});

}  // namespace binpose

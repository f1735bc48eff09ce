#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/io/polygon_mesh.h"
#include "core/run_control.h"

namespace binpose {

/// Reads the vertices and faces of a Wavefront OBJ file; groups, materials, texture, normals and lines are skipped, and
/// no other file is opened.
///
/// @param bytes  hostile.
/// Errors: INVALID_ARGUMENT (a number or an index that cannot be read; names the line), RESOURCE_EXHAUSTED (more faces
/// than `max_triangles`, or more than three times as many vertices).
absl::StatusOr<PolygonMesh> read_obj(std::string_view bytes, std::size_t max_triangles, const RunControl& control = {});

}  // namespace binpose

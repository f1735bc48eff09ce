#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/io/polygon_mesh.h"
#include "core/run_control.h"

namespace binpose {

/// Whether the length is that of a binary STL file with the triangle count that the bytes state. (Its header may well
/// begin with "solid".)
bool is_binary_stl(std::string_view bytes);

/// Reads an STL file, binary or ASCII; told from the content.
///
/// @param bytes  hostile.
/// Errors: INVALID_ARGUMENT (truncated, of a length that contradicts its triangle count, a word out of place),
/// RESOURCE_EXHAUSTED (more than `max_triangles`); or what `control` says.
absl::StatusOr<PolygonMesh> read_stl(std::string_view bytes, std::size_t max_triangles, const RunControl& control = {});

}  // namespace binpose

#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/geometry/mesh.h"
#include "core/run_control.h"

namespace binpose {

enum class MeshFormat { kDetect, kStl, kPly, kObj };

/// What a mesh file may hold.
struct MeshLimits {
  std::size_t max_bytes = std::size_t{64} << 20;
  std::size_t max_triangles = 2'000'000;
};

/// Reads the bytes of an STL (binary, ASCII), PLY or OBJ file; equal vertices are merged, unused ones dropped, faces
/// triangulated. Triangles without area are kept.
///
/// The readers are our own: assimp 5.2 crashes on an OBJ file whose faces precede its vertices and hangs on damaged
/// PLY.
///
/// @param bytes            the file; hostile.
/// @param metres_per_unit  1 or 0.001.
/// Errors, each naming the value and the limit: INVALID_ARGUMENT (empty, truncated, unknown format, no triangle, a
/// coordinate that is not finite, an index out of range), RESOURCE_EXHAUSTED (over a limit); or what `control` says.
absl::StatusOr<Mesh> read_mesh(std::string_view bytes, MeshFormat format, double metres_per_unit,
                               const MeshLimits& limits = {}, const RunControl& control = {});

}  // namespace binpose

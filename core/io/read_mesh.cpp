#include "core/io/read_mesh.h"

#include "absl/strings/str_format.h"
#include "core/io/polygon_mesh.h"
#include "core/io/read_obj.h"
#include "core/io/read_ply.h"
#include "core/io/read_stl.h"
#include "core/io/text_cursor.h"

namespace binpose {
namespace {

/// Whether one of the first lines states a vertex.
bool looks_like_obj(std::string_view bytes) {
  for (TextCursor lines{bytes.substr(0, std::size_t{1} << 20)}; !lines.at_end();) {
    if (TextCursor{lines.next_line()}.next_word() == "v") return true;
  }
  return false;
}

/// Told from the content. What is neither text nor PLY can only be binary STL.
absl::StatusOr<MeshFormat> detect_format(std::string_view bytes) {
  if (is_binary_stl(bytes)) return MeshFormat::kStl;
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return MeshFormat::kPly;
  if (equal_ignoring_case(TextCursor{bytes}.next_word(), "solid")) return MeshFormat::kStl;
  const bool is_text = bytes.substr(0, 1024).find('\0') == std::string_view::npos;
  if (!is_text) return MeshFormat::kStl;
  if (looks_like_obj(bytes)) return MeshFormat::kObj;
  return absl::InvalidArgumentError(
      absl::StrFormat("The mesh (%d bytes, beginning with %s) is neither STL, nor PLY, nor OBJ.", bytes.size(),
                      in_quotes(bytes.substr(0, 16))));
}

absl::StatusOr<PolygonMesh> read_polygons(std::string_view bytes, MeshFormat format, std::size_t max_triangles,
                                          const RunControl& control) {
  if (format == MeshFormat::kStl) return read_stl(bytes, max_triangles, control);
  if (format == MeshFormat::kPly) return read_ply_mesh(bytes, max_triangles, control);
  return read_obj(bytes, max_triangles, control);
}

}  // namespace

absl::StatusOr<Mesh> read_mesh(std::string_view bytes, MeshFormat format, double metres_per_unit,
                               const MeshLimits& limits, const RunControl& control) {
  if (bytes.empty()) return absl::InvalidArgumentError("The mesh is empty: it has 0 bytes.");
  if (bytes.size() > limits.max_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("The mesh has %d bytes; the limit is %d.", bytes.size(), limits.max_bytes));
  }
  if (format == MeshFormat::kDetect) {
    const absl::StatusOr<MeshFormat> detected = detect_format(bytes);
    if (!detected.ok()) return detected.status();
    format = *detected;
  }
  const absl::StatusOr<PolygonMesh> polygons = read_polygons(bytes, format, limits.max_triangles, control);
  if (!polygons.ok()) return polygons.status();
  return triangulate(*polygons, metres_per_unit, limits.max_triangles, control);
}

}  // namespace binpose

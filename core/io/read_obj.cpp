#include "core/io/read_obj.h"

#include <cstdint>

#include "absl/strings/str_format.h"
#include "core/io/text_cursor.h"

namespace binpose {
namespace {

/// `words`: what follows the "v": x y z, and perhaps a weight or a colour.
absl::Status read_vertex(TextCursor words, PolygonMesh& mesh) {
  Eigen::Vector3f vertex;
  for (float& coordinate : vertex) {
    const std::string_view word = words.next_word();
    const std::optional<double> value = parse_number<double>(word);
    if (!value.has_value()) {
      return absl::InvalidArgumentError(
          absl::StrFormat("a vertex has %s where a number should stand", in_quotes(word)));
    }
    coordinate = static_cast<float>(*value);
  }
  mesh.vertices.push_back(vertex);
  return absl::OkStatus();
}

/// `word`: "vertex", "vertex/texture" or "vertex/texture/normal"; counted from 1, or from -1 backwards.
absl::StatusOr<std::uint32_t> read_corner(std::string_view word, std::size_t vertex_count) {
  const std::optional<std::int64_t> number = parse_number<std::int64_t>(word.substr(0, word.find('/')));
  const auto count = static_cast<std::int64_t>(vertex_count);
  if (!number.has_value() || *number == 0 || *number > count || *number < -count) {
    return absl::InvalidArgumentError(
        absl::StrFormat("a face has the vertex %s, but %d vertices come before it", in_quotes(word), count));
  }
  return static_cast<std::uint32_t>(*number > 0 ? *number - 1 : count + *number);
}

/// `words`: what follows the "f".
absl::Status read_face(TextCursor words, PolygonMesh& mesh) {
  std::size_t corner_count = 0;
  for (std::string_view word = words.next_word(); !word.empty(); word = words.next_word()) {
    if (++corner_count > kMaxCorners) {
      return absl::InvalidArgumentError(absl::StrFormat("a face has more than %d corners", kMaxCorners));
    }
    absl::StatusOr<std::uint32_t> corner = read_corner(word, mesh.vertices.size());
    if (!corner.ok()) return corner.status();
    mesh.corners.push_back(*corner);
  }
  mesh.corner_counts.push_back(static_cast<std::uint8_t>(corner_count));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PolygonMesh> read_obj(std::string_view bytes, std::size_t max_triangles, const RunControl& control) {
  TextCursor lines{bytes};
  PolygonMesh mesh;
  for (std::size_t line_number = 1; !lines.at_end(); ++line_number) {
    if (control.interrupted_at(line_number)) return control.status();
    TextCursor words{lines.next_line()};
    const std::string_view keyword = words.next_word();
    absl::Status status;
    if (keyword == "v") status = read_vertex(words, mesh);
    if (keyword == "f") status = read_face(words, mesh);
    if (!status.ok()) {
      return absl::InvalidArgumentError(absl::StrFormat("Line %d of the OBJ file: %s.", line_number, status.message()));
    }
    if (mesh.corner_counts.size() > max_triangles || mesh.vertices.size() > 3 * max_triangles) {
      return absl::ResourceExhaustedError(
          absl::StrFormat("The OBJ file has more than %d faces or %d vertices.", max_triangles, 3 * max_triangles));
    }
  }
  return mesh;
}

}  // namespace binpose

#include "core/io/read_stl.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "absl/strings/str_format.h"
#include "core/io/text_cursor.h"

namespace binpose {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is read by copying its numbers");

// 80 bytes of free text, a 32-bit triangle count, then per triangle a normal, three vertices and 16 bits of attributes.
constexpr std::size_t kBinaryHeaderBytes = 84;
constexpr std::size_t kTriangleBytes = 50;
constexpr std::size_t kNormalBytes = 12;
constexpr std::size_t kVertexBytes = 12;

using Triangle = std::array<Eigen::Vector3f, 3>;

std::uint32_t stated_triangle_count(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kBinaryHeaderBytes - sizeof(count), sizeof(count));
  return count;
}

std::size_t stated_size(std::string_view bytes) {
  return kBinaryHeaderBytes + kTriangleBytes * std::size_t{stated_triangle_count(bytes)};
}

absl::Status too_many(std::size_t count, std::size_t max_triangles) {
  return absl::ResourceExhaustedError(
      absl::StrFormat("The STL file has %d triangles or more; the limit is %d.", count, max_triangles));
}

void append_triangle(const Triangle& corners, PolygonMesh& mesh) {
  mesh.corner_counts.push_back(3);
  for (const Eigen::Vector3f& vertex : corners) {
    mesh.corners.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
    mesh.vertices.push_back(vertex);
  }
}

absl::StatusOr<PolygonMesh> read_binary_stl(std::string_view bytes, std::size_t max_triangles,
                                            const RunControl& control) {
  if (bytes.size() < kBinaryHeaderBytes) {
    return absl::InvalidArgumentError(absl::StrFormat("The binary STL file has %d bytes; its header alone takes %d.",
                                                      bytes.size(), kBinaryHeaderBytes));
  }
  const std::size_t count = stated_triangle_count(bytes);
  if (stated_size(bytes) != bytes.size()) {
    const bool is_short = bytes.size() < stated_size(bytes);
    return absl::InvalidArgumentError(
        absl::StrFormat("The binary STL file states %d triangles, which take %d bytes, but it has %d: %d bytes %s.",
                        count, stated_size(bytes), bytes.size(),
                        is_short ? stated_size(bytes) - bytes.size() : bytes.size() - stated_size(bytes),
                        is_short ? "are missing" : "are too many"));
  }
  if (count > max_triangles) return too_many(count, max_triangles);
  PolygonMesh mesh;
  mesh.corner_counts.reserve(count);
  mesh.corners.reserve(3 * count);
  mesh.vertices.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    if (control.interrupted_at(i)) return control.status();
    const char* triangle = bytes.data() + kBinaryHeaderBytes + i * kTriangleBytes + kNormalBytes;
    Triangle corners;
    for (Eigen::Vector3f& vertex : corners) {
      std::memcpy(vertex.data(), triangle, kVertexBytes);
      triangle += kVertexBytes;
    }
    append_triangle(corners, mesh);
  }
  return mesh;
}

/// Takes the words of an ASCII STL file; the first one out of place is remembered and fails all that follows.
class AsciiStl {
 public:
  explicit AsciiStl(std::string_view bytes) : cursor_{bytes} {}

  std::string_view next_word() { return cursor_.next_word(); }
  void skip_line() { cursor_.next_line(); }

  void expect(std::string_view keyword) {
    const std::string_view word = cursor_.next_word();
    if (!equal_ignoring_case(word, keyword)) fail(keyword, word);
  }

  float number() {
    const std::string_view word = cursor_.next_word();
    const std::optional<double> value = parse_number<double>(word);
    if (!value.has_value()) fail("a number", word);
    return static_cast<float>(value.value_or(0));
  }

  void fail(std::string_view expected, std::string_view found) {
    if (!status_.ok()) return;
    status_ = absl::InvalidArgumentError(
        found.empty()
            ? absl::StrFormat("The ASCII STL file is truncated: it ends where \"%s\" should follow.", expected)
            : absl::StrFormat("The ASCII STL file has %s where \"%s\" should stand.", in_quotes(found), expected));
  }

  const absl::Status& status() const { return status_; }

 private:
  TextCursor cursor_;
  absl::Status status_;
};

/// What follows the word "facet".
void read_facet(AsciiStl& stl, PolygonMesh& mesh) {
  stl.expect("normal");
  for (int i = 0; i < 3; ++i) stl.next_word();  // many writers put nonsense here; the corners' order tells the normal
  stl.expect("outer");
  stl.expect("loop");
  Triangle corners;
  for (Eigen::Vector3f& vertex : corners) {
    stl.expect("vertex");
    for (float& coordinate : vertex) coordinate = stl.number();
  }
  stl.expect("endloop");
  stl.expect("endfacet");
  append_triangle(corners, mesh);
}

absl::StatusOr<PolygonMesh> read_ascii_stl(std::string_view bytes, std::size_t max_triangles,
                                           const RunControl& control) {
  AsciiStl stl(bytes);
  PolygonMesh mesh;
  bool is_open = false;
  while (stl.status().ok()) {
    const std::string_view word = stl.next_word();
    if (word.empty() && !is_open) return mesh;
    if (equal_ignoring_case(word, is_open ? "endsolid" : "solid")) {
      is_open = !is_open;
      stl.skip_line();
    } else if (is_open && equal_ignoring_case(word, "facet")) {
      if (mesh.corner_counts.size() == max_triangles) return too_many(max_triangles + 1, max_triangles);
      if (control.interrupted_at(mesh.corner_counts.size())) return control.status();
      read_facet(stl, mesh);
    } else {
      stl.fail(is_open ? "facet\" or \"endsolid" : "solid", word);
    }
  }
  return stl.status();
}

}  // namespace

bool is_binary_stl(std::string_view bytes) {
  return bytes.size() >= kBinaryHeaderBytes && stated_size(bytes) == bytes.size();
}

absl::StatusOr<PolygonMesh> read_stl(std::string_view bytes, std::size_t max_triangles, const RunControl& control) {
  // The triangle count of any binary file of an admissible size has a zero byte; text has none.
  const bool has_zero = bytes.substr(0, kBinaryHeaderBytes).find('\0') != std::string_view::npos;
  const bool is_text = equal_ignoring_case(TextCursor{bytes}.next_word(), "solid") && !has_zero;
  return is_text && !is_binary_stl(bytes) ? read_ascii_stl(bytes, max_triangles, control)
                                          : read_binary_stl(bytes, max_triangles, control);
}

}  // namespace binpose

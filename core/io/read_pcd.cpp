#include "core/io/read_pcd.h"

#include <liblzf/lzf.h>

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/io/pcd_header.h"
#include "core/io/point_normals.h"
#include "core/io/text_cursor.h"

namespace binpose {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PCD is read by copying its numbers");

constexpr std::size_t kMaxDecompressedBytes = std::size_t{256} << 20;

/// The fields of a vector's three coordinates; none or all of them are there.
using VectorFields = std::array<const PcdField*, 3>;

absl::StatusOr<std::optional<VectorFields>> find_vector(const PcdHeader& header,
                                                        const std::array<std::string_view, 3>& names) {
  VectorFields found{};
  std::size_t found_count = 0;
  for (const PcdField& field : header.fields) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (field.name != names[i] || found[i] != nullptr) continue;
      const bool is_float = field.type == 'F' && (field.size == 4 || field.size == 8) && field.count == 1;
      if (!is_float) {
        return absl::InvalidArgumentError(absl::StrFormat(
            "The PCD field %s has TYPE %s, SIZE %d, COUNT %d; it must be one float (F) of 4 or 8 bytes.", names[i],
            in_quotes(std::string_view(&field.type, 1)), field.size, field.count));
      }
      found[i] = &field;
      ++found_count;
    }
  }
  if (found_count < 3) return std::nullopt;
  return found;
}

absl::Status truncated(std::size_t needed, std::size_t present) {
  return absl::InvalidArgumentError(
      absl::StrFormat("The PCD file is truncated: its data take %d bytes, but %d are there; %d are missing.", needed,
                      present, needed - present));
}

float float_at(const char* bytes, std::size_t size) {
  if (size == sizeof(float)) {
    float value = 0;
    std::memcpy(&value, bytes, sizeof(value));
    return value;
  }
  double value = 0;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<float>(value);
}

/// Whether the coordinates are three floats, one behind the other.
bool in_a_row(const VectorFields& fields) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (fields[axis]->size != sizeof(float)) return false;
    if (fields[axis]->offset != fields[0]->offset + axis * sizeof(float)) return false;
  }
  return true;
}

/// Three floats every `point_bytes`.
void read_rows(const char* first, std::size_t point_bytes, float scale, std::vector<Eigen::Vector3f>& vectors) {
  if (point_bytes == sizeof(Eigen::Vector3f)) {  // nothing but them: one flat loop, which the compiler vectorises
    float* const numbers = vectors.front().data();
    for (std::size_t i = 0; i < 3 * vectors.size(); ++i) {
      numbers[i] = scale * float_at(first + i * sizeof(float), sizeof(float));
    }
    return;
  }
  for (Eigen::Vector3f& vector : vectors) {
    std::memcpy(vector.data(), first, sizeof(vector));
    vector *= scale;
    first += point_bytes;
  }
}

/// The data of a "binary" body: point after point.
absl::Status read_binary(std::string_view body, std::size_t point_bytes, const VectorFields& fields, float scale,
                         std::vector<Eigen::Vector3f>& vectors) {
  if (body.size() < point_bytes * vectors.size()) return truncated(point_bytes * vectors.size(), body.size());
  if (in_a_row(fields)) {  // the usual layout, in a third of the time
    read_rows(body.data() + fields[0]->offset, point_bytes, scale, vectors);
    return absl::OkStatus();
  }
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const char* bytes = body.data() + i * point_bytes + fields[axis]->offset;
      vectors[i][axis] = scale * float_at(bytes, fields[axis]->size);
    }
  }
  return absl::OkStatus();
}

/// The data of a decompressed "binary_compressed" body: field after field.
void read_field_by_field(std::string_view data, const VectorFields& fields, float scale,
                         std::vector<Eigen::Vector3f>& vectors) {
  for (int axis = 0; axis < 3; ++axis) {
    const char* column = data.data() + fields[axis]->offset * vectors.size();
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      vectors[i][axis] = scale * float_at(column + i * fields[axis]->size, fields[axis]->size);
    }
  }
}

/// Undoes "binary_compressed": two 32-bit sizes (packed, plain), then LZF data.
absl::StatusOr<std::string> decompress(std::string_view body, std::size_t expected_bytes) {
  std::array<std::uint32_t, 2> sizes{};
  if (body.size() < sizeof(sizes)) return truncated(sizeof(sizes), body.size());
  std::memcpy(sizes.data(), body.data(), sizeof(sizes));
  body.remove_prefix(sizeof(sizes));
  const auto [packed_bytes, plain_bytes] = sizes;
  if (packed_bytes > body.size()) return truncated(packed_bytes, body.size());
  if (plain_bytes != expected_bytes) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "The PCD file states %d bytes of decompressed data, but its points take %d.", plain_bytes, expected_bytes));
  }
  if (plain_bytes > kMaxDecompressedBytes) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "The PCD file has %d bytes of decompressed data; the limit is %d.", plain_bytes, kMaxDecompressedBytes));
  }
  std::string plain(plain_bytes, '\0');
  if (lzf_decompress(body.data(), packed_bytes, plain.data(), plain_bytes) != plain_bytes) {
    return absl::InvalidArgumentError(
        absl::StrFormat("The %d bytes of compressed data of the PCD file are damaged.", packed_bytes));
  }
  return plain;
}

/// The data of an "ascii" body: one word per number, for both kinds of vector at once.
absl::Status read_ascii(std::string_view body, const PcdHeader& header, const VectorFields& xyz,
                        const std::optional<VectorFields>& normal, float scale, const RunControl& control,
                        PointCloud& cloud) {
  TextCursor cursor{body};
  std::vector<std::string_view> words(header.point_numbers);
  const auto read_vector = [&](const VectorFields& fields, Eigen::Vector3f& vector) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::optional<double> number = parse_number<double>(words[fields[axis]->number_offset]);
      if (!number.has_value()) return false;
      vector[axis] = static_cast<float>(*number);
    }
    return true;
  };
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (control.interrupted_at(i)) return control.status();
    for (std::string_view& word : words) word = cursor.next_word();
    if (words.back().empty() || !read_vector(xyz, cloud.points[i]) ||
        (normal.has_value() && !read_vector(*normal, cloud.normals[i]))) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "Point %d of %d in the PCD file (counted from 0) is truncated or has a word that is no number.", i,
          cloud.points.size()));
    }
    cloud.points[i] *= scale;
  }
  return absl::OkStatus();
}

/// Fills points, times `scale`, and normals.
absl::Status read_body(std::string_view body, const PcdHeader& header, const VectorFields& xyz,
                       const std::optional<VectorFields>& normal, float scale, const RunControl& control,
                       PointCloud& cloud) {
  if (header.encoding == PcdEncoding::kAscii) return read_ascii(body, header, xyz, normal, scale, control, cloud);
  if (header.encoding == PcdEncoding::kBinary) {
    absl::Status status = read_binary(body, header.point_bytes, xyz, scale, cloud.points);
    if (status.ok() && normal.has_value()) status = read_binary(body, header.point_bytes, *normal, 1, cloud.normals);
    return status;
  }
  const absl::StatusOr<std::string> plain = decompress(body, header.point_bytes * header.point_count());
  if (!plain.ok()) return plain.status();
  read_field_by_field(*plain, xyz, scale, cloud.points);
  if (normal.has_value()) read_field_by_field(*plain, *normal, 1, cloud.normals);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PointCloud> read_pcd(std::string_view bytes, double metres_per_unit, std::size_t max_points,
                                    const RunControl& control) {
  const absl::StatusOr<PcdHeader> header = parse_pcd_header(bytes, max_points);
  if (!header.ok()) return header.status();
  const auto xyz = find_vector(*header, {"x", "y", "z"});
  if (!xyz.ok()) return xyz.status();
  if (!xyz->has_value()) return absl::InvalidArgumentError("The PCD file lacks one of the fields x, y, z.");
  const auto normal = find_vector(*header, {"normal_x", "normal_y", "normal_z"});
  if (!normal.ok()) return normal.status();
  const std::string_view body = bytes.substr(header->body_offset);
  PointCloud cloud;
  cloud.points.resize(header->point_count());
  if (normal->has_value()) cloud.normals.resize(header->point_count());
  const auto scale = static_cast<float>(metres_per_unit);
  absl::Status status = read_body(body, *header, **xyz, *normal, scale, control, cloud);
  if (!status.ok()) return status;
  if (absl::Status status = control.status(); !status.ok()) return status;
  normalize_or_drop_normals(cloud);
  cloud.width = static_cast<std::uint32_t>(header->width);
  cloud.height = static_cast<std::uint32_t>(header->height);
  cloud.sensor_position = header->viewpoint * metres_per_unit;
  return cloud;
}

}  // namespace binpose

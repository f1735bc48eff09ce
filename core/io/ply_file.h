#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "core/io/text_cursor.h"
#include "core/run_control.h"

namespace binpose {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

/// A column of an element's table.
struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;   ///< of the number, or of a list's entries
  std::optional<PlyType> count_type;  ///< set for a list
};

/// A table of rows, for example the vertices.
struct PlyElement {
  std::string name;
  std::size_t row_count = 0;
  std::vector<PlyProperty> properties;

  /// Index of the property of that name, or nothing; lists and numbers are told apart.
  std::optional<std::size_t> find(std::string_view property, bool is_list = false) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;  ///< in the order of the body
  std::size_t body_offset = 0;
};

/// Reads the header of a PLY file. Every row of every element is known to take at least one byte of the file.
///
/// @param bytes  hostile.
/// Errors: INVALID_ARGUMENT, naming the line.
absl::StatusOr<PlyHeader> parse_ply_header(std::string_view bytes);

/// One row: a number per property (a list's length for a list), and the entries of one chosen list.
struct PlyRow {
  std::vector<double> numbers;
  std::vector<double> list;
};

/// Reads the rows of a PLY file's body, element after element.
class PlyBody {
 public:
  PlyBody(std::string_view bytes, const PlyHeader& header)
      : encoding_(header.encoding), cursor_{bytes.substr(header.body_offset)} {}

  /// Takes the next row. `list`: index of the property whose entries are kept.
  /// Errors: INVALID_ARGUMENT (the body is truncated or has a word that is no number).
  absl::Status read_row(const PlyElement& element, std::optional<std::size_t> list, PlyRow& row);

  /// Takes all rows of an element that nobody wants.
  absl::Status skip_rows(const PlyElement& element, const RunControl& control);

 private:
  std::optional<double> next_number(PlyType type);

  PlyEncoding encoding_;
  TextCursor cursor_;
};

}  // namespace binpose

#include "core/io/ply_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

#include "absl/strings/str_format.h"

namespace binpose {
namespace {

static_assert(std::endian::native == std::endian::little, "little endian numbers are read by copying them");

constexpr std::size_t kMaxColumns = 256;

std::optional<PlyType> parse_type(std::string_view word) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypes = {{
      {"char", PlyType::kInt8},
      {"int8", PlyType::kInt8},
      {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},
      {"short", PlyType::kInt16},
      {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},
      {"uint16", PlyType::kUint16},
      {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},
      {"uint", PlyType::kUint32},
      {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat32},
      {"float32", PlyType::kFloat32},
      {"double", PlyType::kFloat64},
      {"float64", PlyType::kFloat64},
  }};
  for (const auto& [name, type] : kTypes) {
    if (name == word) return type;
  }
  return std::nullopt;
}

std::optional<PlyEncoding> parse_encoding(std::string_view word) {
  if (word == "ascii") return PlyEncoding::kAscii;
  if (word == "binary_little_endian") return PlyEncoding::kLittleEndian;
  if (word == "binary_big_endian") return PlyEncoding::kBigEndian;
  return std::nullopt;
}

/// `words`: what follows "property".
bool read_property(TextCursor words, PlyHeader& header) {
  if (header.elements.empty() || header.elements.back().properties.size() == kMaxColumns) return false;
  PlyProperty property;
  std::optional<PlyType> type;
  std::string_view word = words.next_word();
  if (word == "list") {
    property.count_type = parse_type(words.next_word());
    if (!property.count_type.has_value()) return false;
    word = words.next_word();
  }
  type = parse_type(word);
  property.name = words.next_word();
  if (!type.has_value() || property.name.empty()) return false;
  property.type = *type;
  header.elements.back().properties.push_back(std::move(property));
  return true;
}

/// `words`: what follows "element".
bool read_element(TextCursor words, PlyHeader& header) {
  PlyElement element;
  element.name = words.next_word();
  const std::optional<std::size_t> count = parse_number<std::size_t>(words.next_word());
  if (!count.has_value() || header.elements.size() == kMaxColumns) return false;
  element.row_count = *count;
  header.elements.push_back(std::move(element));
  return true;
}

/// Whether the line makes sense after those before it.
bool read_header_line(std::string_view line, std::optional<PlyEncoding>& encoding, PlyHeader& header) {
  TextCursor words{line};
  const std::string_view keyword = words.next_word();
  if (keyword == "format") {
    if (encoding.has_value()) return false;
    encoding = parse_encoding(words.next_word());
    return encoding.has_value();
  }
  if (keyword == "element") return read_element(words, header);
  if (keyword == "property") return read_property(words, header);
  return keyword == "comment" || keyword == "obj_info" || keyword.empty();
}

/// Refuses row counts that the rest of the file cannot hold, so that nobody loops or allocates for them.
absl::Status check_row_counts(const PlyHeader& header, std::size_t body_bytes) {
  for (const PlyElement& element : header.elements) {
    if (element.row_count == 0) continue;
    if (element.properties.empty()) {
      return absl::InvalidArgumentError(
          absl::StrFormat("The PLY element %s has rows but no property.", in_quotes(element.name)));
    }
    if (element.row_count > body_bytes) {
      return absl::InvalidArgumentError(
          absl::StrFormat("The PLY file is truncated: it states %d rows of %s, but only %d bytes follow its header.",
                          element.row_count, in_quotes(element.name), body_bytes));
    }
  }
  return absl::OkStatus();
}

template <typename Number>
double from_bytes(const char* bytes, bool is_big_endian) {
  std::array<char, sizeof(Number)> ordered{};
  std::memcpy(ordered.data(), bytes, sizeof(Number));
  if (is_big_endian) std::reverse(ordered.begin(), ordered.end());
  return static_cast<double>(std::bit_cast<Number>(ordered));
}

std::size_t size_of(PlyType type) {
  static constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

double decode(const char* bytes, PlyType type, bool is_big_endian) {
  switch (type) {
    case PlyType::kInt8:
      return from_bytes<std::int8_t>(bytes, is_big_endian);
    case PlyType::kUint8:
      return from_bytes<std::uint8_t>(bytes, is_big_endian);
    case PlyType::kInt16:
      return from_bytes<std::int16_t>(bytes, is_big_endian);
    case PlyType::kUint16:
      return from_bytes<std::uint16_t>(bytes, is_big_endian);
    case PlyType::kInt32:
      return from_bytes<std::int32_t>(bytes, is_big_endian);
    case PlyType::kUint32:
      return from_bytes<std::uint32_t>(bytes, is_big_endian);
    case PlyType::kFloat32:
      return from_bytes<float>(bytes, is_big_endian);
    case PlyType::kFloat64:
      return from_bytes<double>(bytes, is_big_endian);
  }
  return 0;
}

}  // namespace

std::optional<std::size_t> PlyElement::find(std::string_view property, bool is_list) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == property && properties[i].count_type.has_value() == is_list) return i;
  }
  return std::nullopt;
}

absl::StatusOr<PlyHeader> parse_ply_header(std::string_view bytes) {
  TextCursor lines{bytes};
  PlyHeader header;
  std::optional<PlyEncoding> encoding;
  if (lines.next_line() != "ply") {
    return absl::InvalidArgumentError("The PLY file does not begin with the line \"ply\".");
  }
  for (int line_number = 2; !lines.at_end(); ++line_number) {
    const std::string_view line = lines.next_line();
    if (line == "end_header") {
      if (!encoding.has_value()) return absl::InvalidArgumentError("The PLY header has no \"format\" line.");
      header.encoding = *encoding;
      header.body_offset = bytes.size() - lines.rest.size();
      if (absl::Status status = check_row_counts(header, lines.rest.size()); !status.ok()) return status;
      return header;
    }
    if (!read_header_line(line, encoding, header)) {
      return absl::InvalidArgumentError(
          absl::StrFormat("Line %d of the PLY header cannot be read: %s.", line_number, in_quotes(line)));
    }
  }
  return absl::InvalidArgumentError("The PLY file is truncated: its header has no \"end_header\" line.");
}

std::optional<double> PlyBody::next_number(PlyType type) {
  if (encoding_ == PlyEncoding::kAscii) return parse_number<double>(cursor_.next_word());
  const std::size_t size = size_of(type);
  if (cursor_.rest.size() < size) return std::nullopt;
  const double number = decode(cursor_.rest.data(), type, encoding_ == PlyEncoding::kBigEndian);
  cursor_.rest.remove_prefix(size);
  return number;
}

absl::Status PlyBody::read_row(const PlyElement& element, std::optional<std::size_t> list, PlyRow& row) {
  const auto unreadable = [&] {
    return absl::InvalidArgumentError(
        absl::StrFormat("The PLY file is truncated or has a word that is no number among its %d rows of %s.",
                        element.row_count, in_quotes(element.name)));
  };
  row.numbers.resize(element.properties.size());
  row.list.clear();
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    const std::optional<double> number = next_number(property.count_type.value_or(property.type));
    if (!number.has_value()) return unreadable();
    row.numbers[i] = *number;
    if (!property.count_type.has_value()) continue;
    if (!(*number >= 0 && *number <= static_cast<double>(cursor_.rest.size()))) return unreadable();
    for (double k = 0; k < *number; ++k) {
      const std::optional<double> entry = next_number(property.type);
      if (!entry.has_value()) return unreadable();
      if (i == list) row.list.push_back(*entry);
    }
  }
  return absl::OkStatus();
}

absl::Status PlyBody::skip_rows(const PlyElement& element, const RunControl& control) {
  PlyRow row;
  for (std::size_t i = 0; i < element.row_count; ++i) {
    if (control.interrupted_at(i)) return control.status();
    if (absl::Status status = read_row(element, std::nullopt, row); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace binpose

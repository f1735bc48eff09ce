#include "core/io/pcd_header.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include "absl/strings/str_format.h"
#include "core/io/text_cursor.h"

namespace binpose {
namespace {

using Words = std::vector<std::string_view>;

constexpr std::size_t kMaxFields = 128;
constexpr std::size_t kMaxFieldCount = 4096;  // for example a feature histogram

absl::Status refuse(std::string_view keyword, std::string_view reason) {
  return absl::InvalidArgumentError(absl::StrFormat("%s of the PCD header %s.", keyword, reason));
}

Words split(std::string_view line) {
  Words words;
  TextCursor cursor{line};
  for (std::string_view word = cursor.next_word(); !word.empty(); word = cursor.next_word()) words.push_back(word);
  return words;
}

/// The lines up to DATA, by their first word.
absl::StatusOr<std::map<std::string_view, Words>> read_lines(TextCursor& lines) {
  std::map<std::string_view, Words> entries;
  while (!lines.at_end()) {
    Words words = split(lines.next_line());
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string_view keyword = words[0];
    words.erase(words.begin());
    if (words.size() > kMaxFields) return refuse(in_quotes(keyword), "has too many words; the limit is 128");
    if (!entries.emplace(keyword, std::move(words)).second) return refuse(in_quotes(keyword), "stands there twice");
    if (entries.size() > 16) break;
    if (keyword == "DATA") return entries;
  }
  return absl::InvalidArgumentError("The file is no PCD file, or truncated: its header has no DATA line.");
}

/// The words after `keyword` as numbers in [low, high]; `count` of them.
absl::StatusOr<std::vector<std::size_t>> read_counts(const std::map<std::string_view, Words>& entries,
                                                     std::string_view keyword, std::size_t count, std::size_t low,
                                                     std::size_t high) {
  const auto entry = entries.find(keyword);
  if (entry == entries.end()) return refuse(keyword, "is missing");
  if (entry->second.size() != count) {
    return refuse(keyword, absl::StrFormat("has %d entries instead of %d", entry->second.size(), count));
  }
  std::vector<std::size_t> numbers;
  for (const std::string_view word : entry->second) {
    const std::optional<std::size_t> number = parse_number<std::size_t>(word);
    if (!number.has_value() || *number < low || *number > high) {
      return refuse(keyword,
                    absl::StrFormat("is %s; it must be a whole number in [%d, %d]", in_quotes(word), low, high));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

/// FIELDS, SIZE, TYPE and COUNT.
absl::Status read_fields(const std::map<std::string_view, Words>& entries, PcdHeader& header) {
  const auto names = entries.find("FIELDS");
  const auto types = entries.find("TYPE");
  if (names == entries.end() || names->second.empty()) return refuse("FIELDS", "is missing");
  const std::size_t field_count = names->second.size();
  if (types == entries.end() || types->second.size() != field_count) return refuse("TYPE", "does not fit FIELDS");
  const auto sizes = read_counts(entries, "SIZE", field_count, 1, 8);
  if (!sizes.ok()) return sizes.status();
  auto counts = entries.contains("COUNT") ? read_counts(entries, "COUNT", field_count, 0, kMaxFieldCount)
                                          : std::vector<std::size_t>(field_count, 1);
  if (!counts.ok()) return counts.status();
  for (std::size_t i = 0; i < field_count; ++i) {
    PcdField field{.name = std::string(names->second[i]),
                   .size = (*sizes)[i],
                   .type = types->second[i][0],
                   .count = (*counts)[i],
                   .offset = header.point_bytes,
                   .number_offset = header.point_numbers};
    header.point_bytes += field.size * field.count;
    header.point_numbers += field.count;
    header.fields.push_back(std::move(field));
  }
  return absl::OkStatus();
}

/// WIDTH, HEIGHT and POINTS.
absl::Status read_extent(const std::map<std::string_view, Words>& entries, std::size_t max_points, PcdHeader& header) {
  const auto width = read_counts(entries, "WIDTH", 1, 0, UINT32_MAX);
  if (!width.ok()) return width.status();
  const auto height = read_counts(entries, "HEIGHT", 1, 0, UINT32_MAX);
  if (!height.ok()) return height.status();
  header.width = width->front();
  header.height = height->front();
  if (entries.contains("POINTS")) {
    const auto points = read_counts(entries, "POINTS", 1, 0, UINT64_MAX);
    if (!points.ok()) return points.status();
    if (points->front() != header.point_count()) {
      return refuse("POINTS", absl::StrFormat("is %d, but WIDTH x HEIGHT is %d x %d", points->front(), header.width,
                                              header.height));
    }
  }
  if (header.point_count() == 0) return absl::InvalidArgumentError("The PCD file has 0 points.");
  if (header.point_count() > max_points) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("The PCD file has %d points; the limit is %d.", header.point_count(), max_points));
  }
  return absl::OkStatus();
}

/// VIEWPOINT: where the sensor stood, then its orientation, which nobody needs. Absent: the origin.
absl::Status read_viewpoint(const std::map<std::string_view, Words>& entries, PcdHeader& header) {
  const auto entry = entries.find("VIEWPOINT");
  if (entry == entries.end()) return absl::OkStatus();
  if (entry->second.size() != 7) return refuse("VIEWPOINT", "must have 7 numbers: tx ty tz qw qx qy qz");
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<double> number = parse_number<double>(entry->second[axis]);
    if (!number.has_value() || !std::isfinite(*number)) {
      return refuse("VIEWPOINT", absl::StrFormat("has %s, which is no finite number", in_quotes(entry->second[axis])));
    }
    header.viewpoint[axis] = *number;
  }
  return absl::OkStatus();
}

absl::Status read_encoding(const Words& words, PcdHeader& header) {
  const std::string_view name = words.empty() ? "" : words[0];
  if (name == "ascii") {
    header.encoding = PcdEncoding::kAscii;
  } else if (name == "binary") {
    header.encoding = PcdEncoding::kBinary;
  } else if (name == "binary_compressed") {
    header.encoding = PcdEncoding::kBinaryCompressed;
  } else {
    return refuse("DATA", absl::StrFormat("is %s; it must be ascii, binary or binary_compressed", in_quotes(name)));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PcdHeader> parse_pcd_header(std::string_view bytes, std::size_t max_points) {
  TextCursor lines{bytes};
  const auto entries = read_lines(lines);
  if (!entries.ok()) return entries.status();
  PcdHeader header;
  header.body_offset = bytes.size() - lines.rest.size();
  if (absl::Status status = read_fields(*entries, header); !status.ok()) return status;
  if (absl::Status status = read_extent(*entries, max_points, header); !status.ok()) return status;
  if (absl::Status status = read_viewpoint(*entries, header); !status.ok()) return status;
  if (absl::Status status = read_encoding(entries->at("DATA"), header); !status.ok()) return status;
  return header;
}

}  // namespace binpose

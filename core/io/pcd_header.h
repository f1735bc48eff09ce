#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace binpose {

enum class PcdEncoding { kAscii, kBinary, kBinaryCompressed };

/// One field of a point: `count` numbers of `size` bytes.
struct PcdField {
  std::string name;
  std::size_t size = 0;
  char type = 'F';  ///< F float, I signed, U unsigned
  std::size_t count = 1;
  std::size_t offset = 0;         ///< bytes before it in a point
  std::size_t number_offset = 0;  ///< numbers before it in a point
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::size_t width = 0;
  std::size_t height = 1;
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
  PcdEncoding encoding = PcdEncoding::kAscii;
  std::size_t body_offset = 0;
  std::size_t point_bytes = 0;    ///< sum over the fields
  std::size_t point_numbers = 0;  ///< sum over the fields

  std::size_t point_count() const { return width * height; }
};

/// Reads the header of a PCD file; width * height is in [1, max_points], sizes and counts fit together.
///
/// @param bytes  hostile.
/// Errors: INVALID_ARGUMENT, naming the line or the contradiction; RESOURCE_EXHAUSTED (more than `max_points`).
absl::StatusOr<PcdHeader> parse_pcd_header(std::string_view bytes, std::size_t max_points);

}  // namespace binpose

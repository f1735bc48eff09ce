#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace binpose::client {

/// A 16-bit image.
struct DepthPixels {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::string uint16;  ///< width * height values, little endian, row by row
};

/// Whether the bytes begin like a PGM or PNG file.
bool is_depth_image(std::string_view bytes);

/// Decodes a 16-bit PGM (P5) or a 16-bit greyscale PNG file.
///
/// @param bytes  hostile; at most 64 million pixels.
/// Errors: INVALID_ARGUMENT (another format, another depth, truncated, too large).
absl::StatusOr<DepthPixels> decode_depth_pixels(std::string_view bytes);

}  // namespace binpose::client

#include "client/depth_pixels.h"

#include <png.h>

#include <algorithm>
#include <charconv>
#include <csetjmp>
#include <cstddef>
#include <cstring>
#include <optional>
#include <utility>

namespace binpose::client {
namespace {

constexpr std::uint32_t kMaxSide = 65536;
constexpr std::size_t kMaxPixels = 64'000'000;
constexpr std::string_view kPgmMagic = "P5";
constexpr std::string_view kPngMagic = "\x89PNG\r\n\x1a\n";

absl::Status refuse(const std::string& reason) { return absl::InvalidArgumentError("The depth image " + reason + "."); }

absl::Status check_size(std::size_t width, std::size_t height) {
  if (width >= 1 && height >= 1 && width <= kMaxSide && height <= kMaxSide && width * height <= kMaxPixels) {
    return absl::OkStatus();
  }
  return refuse("has " + std::to_string(width) + " x " + std::to_string(height) + " pixels; the limit is " +
                std::to_string(kMaxPixels));
}

/// Takes the next number of a PGM header, after white space and comments.
std::optional<std::uint32_t> take_number(std::string_view& bytes) {
  while (!bytes.empty() && (bytes[0] == '#' || std::strchr(" \t\r\n", bytes[0]) != nullptr)) {
    bytes.remove_prefix(bytes[0] == '#' ? std::min(bytes.find('\n'), bytes.size() - 1) + 1 : 1);
  }
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(bytes.data(), bytes.data() + bytes.size(), number);
  if (error != std::errc()) return std::nullopt;
  bytes.remove_prefix(static_cast<std::size_t>(end - bytes.data()));
  return number;
}

/// A PGM's 16-bit numbers are big endian.
absl::StatusOr<DepthPixels> decode_pgm(std::string_view bytes) {
  bytes.remove_prefix(kPgmMagic.size());
  const std::optional<std::uint32_t> width = take_number(bytes);
  const std::optional<std::uint32_t> height = take_number(bytes);
  const std::optional<std::uint32_t> largest = take_number(bytes);
  if (!width || !height || !largest || bytes.empty()) return refuse("has a damaged PGM header");
  if (*largest < 256 || *largest > 65535) {
    return refuse("has a largest value of " + std::to_string(*largest) + "; a 16-bit PGM has 256 to 65535");
  }
  if (absl::Status status = check_size(*width, *height); !status.ok()) return status;
  bytes.remove_prefix(1);  // the one white space between header and pixels
  const std::size_t size = 2 * std::size_t{*width} * *height;
  if (bytes.size() < size) {
    return refuse("is truncated: " + std::to_string(size - bytes.size()) + " of " + std::to_string(size) +
                  " bytes are missing");
  }
  DepthPixels pixels{*width, *height, std::string(bytes.substr(0, size))};
  for (std::size_t i = 0; i < size; i += 2) std::swap(pixels.uint16[i], pixels.uint16[i + 1]);
  return pixels;
}

/// What libpng calls back with.
struct PngSource {
  std::string_view rest;
  std::string error;
};

void read_png_bytes(png_structp png, png_bytep to, std::size_t size) {
  auto& source = *static_cast<PngSource*>(png_get_io_ptr(png));
  if (source.rest.size() < size) png_error(png, "it is truncated");
  std::memcpy(to, source.rest.data(), size);
  source.rest.remove_prefix(size);
}

void on_png_error(png_structp png, png_const_charp message) {
  static_cast<PngSource*>(png_get_error_ptr(png))->error = message;
  png_longjmp(png, 1);
}

void on_png_warning(png_structp /*png*/, png_const_charp /*message*/) {}

/// The part that libpng leaves by longjmp on an error: no object that needs a destructor may live in here.
bool read_png_rows(png_structp png, png_infop info, PngSource& source, DepthPixels& pixels) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, &source, read_png_bytes);
  png_set_user_limits(png, kMaxSide, kMaxSide);
  png_read_info(png, info);
  if (png_get_bit_depth(png, info) != 16 || png_get_color_type(png, info) != PNG_COLOR_TYPE_GRAY) {
    png_error(png, "it must be greyscale with 16 bits a pixel");
  }
  pixels.width = png_get_image_width(png, info);
  pixels.height = png_get_image_height(png, info);
  if (std::size_t{pixels.width} * pixels.height > kMaxPixels) png_error(png, "it has more than 64 million pixels");
  const int passes = png_set_interlace_handling(png);
  png_set_swap(png);  // PNG is big endian
  pixels.uint16.resize(2 * std::size_t{pixels.width} * pixels.height);
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t row = 0; row < pixels.height; ++row) {
      png_read_row(png, reinterpret_cast<png_bytep>(pixels.uint16.data() + 2 * row * pixels.width), nullptr);
    }
  }
  return true;
}

absl::StatusOr<DepthPixels> decode_png(std::string_view bytes) {
  PngSource source{bytes, ""};
  DepthPixels pixels;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &source, on_png_error, on_png_warning);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  const bool is_read = info != nullptr && read_png_rows(png, info, source, pixels);
  png_destroy_read_struct(&png, &info, nullptr);
  if (!is_read) return refuse("is a PNG file that cannot be read: " + source.error);
  return pixels;
}

}  // namespace

bool is_depth_image(std::string_view bytes) { return bytes.starts_with(kPgmMagic) || bytes.starts_with(kPngMagic); }

absl::StatusOr<DepthPixels> decode_depth_pixels(std::string_view bytes) {
  if (bytes.starts_with(kPgmMagic)) return decode_pgm(bytes);
  if (bytes.starts_with(kPngMagic)) return decode_png(bytes);
  return refuse("is neither PGM (P5) nor PNG");
}

}  // namespace binpose::client

#include "tests/support/read_png.h"

#include <png.h>

#include <stdexcept>

namespace binpose::testing {

std::vector<std::uint16_t> read_png16(const std::filesystem::path& path, std::size_t count) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&image, path.c_str())) {
    throw std::runtime_error(path.string() + ": " + image.message);
  }
  // Linear 16-bit grey is the one simplified format that hands depth values over unchanged.
  image.format = PNG_FORMAT_LINEAR_Y;
  if (static_cast<std::size_t>(image.width) * image.height != count) {
    png_image_free(&image);
    throw std::runtime_error(path.string() + " has another size than camera.json says");
  }
  std::vector<std::uint16_t> values(count);
  if (!png_image_finish_read(&image, nullptr, values.data(), 0, nullptr)) {
    throw std::runtime_error(path.string() + ": " + image.message);
  }
  return values;
}

}  // namespace binpose::testing

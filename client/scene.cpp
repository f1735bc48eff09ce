#include "client/scene.h"

#include <bit>
#include <cstdint>
#include <string>
#include <utility>

#include "client/camera.h"
#include "client/depth_pixels.h"
#include "client/read_file.h"

namespace binpose::client {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers go over the wire as they lie in memory");

/// The error with the name of the file that it is about.
absl::Status about(const std::filesystem::path& path, const absl::Status& status) {
  return {status.code(), path.string() + ": " + std::string(status.message())};
}

/// Millimetres -> the unit of the request.
double per_millimetre(v1::LengthUnit unit) { return unit == v1::LENGTH_UNIT_METRE ? 0.001 : 1; }

absl::StatusOr<v1::PointCloud> read_depth(const std::filesystem::path& image, const Camera& camera,
                                          v1::LengthUnit unit) {
  absl::StatusOr<std::string> bytes = read_file(image);
  if (!bytes.ok()) return bytes.status();
  absl::StatusOr<DepthPixels> pixels = decode_depth_pixels(*bytes);
  if (!pixels.ok()) return about(image, pixels.status());
  if (pixels->width != camera.width || pixels->height != camera.height) {
    return absl::InvalidArgumentError(image.string() + " has " + std::to_string(pixels->width) + " x " +
                                      std::to_string(pixels->height) + " pixels, but its camera has " +
                                      std::to_string(camera.width) + " x " + std::to_string(camera.height) + ".");
  }
  v1::PointCloud cloud;
  cloud.set_unit(unit);
  cloud.mutable_depth()->set_width(camera.width);
  cloud.mutable_depth()->set_height(camera.height);
  cloud.mutable_depth()->set_uint16(std::move(pixels->uint16));
  cloud.mutable_depth()->set_depth_scale(camera.millimetres_per_step * per_millimetre(unit));
  *cloud.mutable_depth()->mutable_intrinsics() = camera.intrinsics;
  return cloud;
}

/// A scene whose camera file names its depth image.
absl::StatusOr<v1::PointCloud> read_depth_of(const std::filesystem::path& camera_file, v1::LengthUnit unit) {
  const absl::StatusOr<Camera> camera = read_camera(camera_file);
  if (!camera.ok()) return camera.status();
  if (camera->depth_file.empty()) {
    return absl::InvalidArgumentError(camera_file.string() + " lacks depth_file, the name of its depth image.");
  }
  return read_depth(camera_file.parent_path() / camera->depth_file, *camera, unit);
}

}  // namespace

v1::PointCloud cloud_from_points(std::span<const float> xyz, v1::LengthUnit unit) {
  const std::size_t count = xyz.size() / 3;
  v1::PointCloud cloud;
  cloud.set_unit(unit);
  cloud.mutable_points()->set_width(static_cast<std::uint32_t>(count));
  cloud.mutable_points()->set_height(1);
  cloud.mutable_points()->set_xyz(xyz.data(), 3 * count * sizeof(float));
  return cloud;
}

absl::StatusOr<v1::PointCloud> read_scene(const std::filesystem::path& path,
                                          const std::optional<std::filesystem::path>& camera, v1::LengthUnit unit) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return read_depth_of(path / "camera.json", unit);
  if (path.extension() == ".json") return read_depth_of(path, unit);
  if (camera.has_value()) {
    const absl::StatusOr<Camera> intrinsics = read_camera(*camera);
    if (!intrinsics.ok()) return intrinsics.status();
    return read_depth(path, *intrinsics, unit);
  }
  absl::StatusOr<std::string> bytes = read_file(path);
  if (!bytes.ok()) return bytes.status();
  v1::PointCloud cloud;
  cloud.set_unit(unit);
  if (bytes->starts_with("ply")) {
    cloud.set_ply(*std::move(bytes));
  } else if (is_depth_image(*bytes)) {
    return absl::InvalidArgumentError(path.string() +
                                      " is an image; name its camera file, or give the folder of both.");
  } else {
    cloud.set_pcd(*std::move(bytes));
  }
  return cloud;
}

}  // namespace binpose::client

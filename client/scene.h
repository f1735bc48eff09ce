#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "absl/status/statusor.h"
#include "binpose/v1/types.pb.h"

namespace binpose::client {

/// An unordered cloud from packed numbers.
///
/// @param xyz  x y z of each point, in `unit`; NaN = no measurement. One or two numbers left over are ignored.
v1::PointCloud cloud_from_points(std::span<const float> xyz, v1::LengthUnit unit);

/// Reads a scene from files.
///
/// @param path    a PLY or PCD file (told from the content, sent as it is); or a depth image (16-bit PGM or PNG) when
///                `camera` is given; or a camera file or a folder with a camera.json, which names the depth image.
/// @param camera  camera file of the depth image `path`, see read_camera().
/// @param unit    of the lengths in a PLY or PCD file, and of those in the answer.
/// Errors: NOT_FOUND, INVALID_ARGUMENT; each names the file.
absl::StatusOr<v1::PointCloud> read_scene(const std::filesystem::path& path,
                                          const std::optional<std::filesystem::path>& camera, v1::LengthUnit unit);

}  // namespace binpose::client

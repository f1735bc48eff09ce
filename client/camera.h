#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "absl/status/statusor.h"
#include "binpose/v1/types.pb.h"

namespace binpose::client {

/// What a camera file says about the depth image beside it.
struct Camera {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  v1::CameraIntrinsics intrinsics;
  double millimetres_per_step = 0;  ///< z = pixel value * this
  std::string depth_file;           ///< name of the depth image, relative to the camera file; may be empty
};

/// Reads a camera file: a JSON object with the numbers width, height, fx, fy, cx, cy (pixels), depth_unit_mm
/// (millimetres per step of a pixel value) and, if there, the text depth_file.
///
/// Errors: those of read_file(); INVALID_ARGUMENT, naming the file and the field.
absl::StatusOr<Camera> read_camera(const std::filesystem::path& path);

}  // namespace binpose::client

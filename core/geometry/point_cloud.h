#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace binpose {

/// Pinhole camera without distortion; pixels, (0, 0) = centre of the first pixel.
struct CameraIntrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// What the sensor measured, in the scene frame, metres.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;   ///< width * height, row by row; NaN = no measurement
  std::vector<Eigen::Vector3f> normals;  ///< empty, or one unit normal per point
  std::uint32_t width = 0;
  std::uint32_t height = 0;  ///< 1 = unordered
  Eigen::Vector3d sensor_position = Eigen::Vector3d::Zero();
  std::optional<CameraIntrinsics>
      intrinsics;  ///< set for clouds from a depth image: pixel (u, v) is points[v * width + u]
};

}  // namespace binpose

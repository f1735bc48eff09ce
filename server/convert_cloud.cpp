#include "server/convert_cloud.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/io/read_pcd.h"
#include "core/io/read_ply.h"
#include "server/convert_geometry.h"
#include "server/decode_time.h"
#include "server/status.h"

namespace binpose::server {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// OK when width x height is a number of points that may be.
absl::Status check_size(std::string_view field, std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s has width %d and height %d; both must be at least 1.", field, width, height));
  }
  const std::uint64_t count = std::uint64_t{width} * height;
  if (count > kMaxCloudPoints) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("%s has %d points; the limit is %d.", field, count, kMaxCloudPoints));
  }
  return absl::OkStatus();
}

/// OK when `bytes` holds exactly `count` items of `item_bytes`.
absl::Status check_bytes(std::string_view field, std::string_view bytes, std::size_t count, std::size_t item_bytes) {
  if (bytes.size() == count * item_bytes) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat("%s has %d bytes; width x height = %d points of %d bytes need %d.",
                                                    field, bytes.size(), count, item_bytes, count * item_bytes));
}

absl::Status check_positive(std::string_view field, double value) {
  if (std::isfinite(value) && value > 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat("%s is %g; it must be above 0.", field, value));
}

/// Item `index` of packed little-endian values.
template <class Value>
Value unpack(std::string_view bytes, std::size_t index) {
  Value value;
  std::memcpy(&value, bytes.data() + index * sizeof(Value), sizeof(Value));
  return value;
}

std::vector<Eigen::Vector3f> unpack_vectors(std::string_view bytes, double scale) {
  std::vector<Eigen::Vector3f> vectors(bytes.size() / (3 * sizeof(float)));
  if (vectors.empty()) return vectors;
  // One flat loop, which the compiler vectorises.
  float* const numbers = vectors.front().data();
  for (std::size_t i = 0; i < 3 * vectors.size(); ++i) numbers[i] = static_cast<float>(scale * unpack<float>(bytes, i));
  return vectors;
}

absl::StatusOr<PointCloud> from_points(const v1::PackedPoints& message, double metres_per_unit) {
  if (absl::Status status = check_size("cloud.points", message.width(), message.height()); !status.ok()) return status;
  const std::size_t count = std::size_t{message.width()} * message.height();
  constexpr std::size_t kPointBytes = 3 * sizeof(float);
  absl::Status status = check_bytes("cloud.points.xyz", message.xyz(), count, kPointBytes);
  if (status.ok() && !message.normals().empty()) {
    status = check_bytes("cloud.points.normals", message.normals(), count, kPointBytes);
  }
  if (!status.ok()) return status;
  PointCloud cloud;
  cloud.width = message.width();
  cloud.height = message.height();
  cloud.points = unpack_vectors(message.xyz(), metres_per_unit);
  cloud.normals = unpack_vectors(message.normals(), 1);
  return cloud;
}

absl::StatusOr<CameraIntrinsics> to_intrinsics(const v1::CameraIntrinsics& message) {
  if (absl::Status status = check_positive("cloud.depth.intrinsics.fx", message.fx()); !status.ok()) return status;
  if (absl::Status status = check_positive("cloud.depth.intrinsics.fy", message.fy()); !status.ok()) return status;
  if (!std::isfinite(message.cx()) || !std::isfinite(message.cy())) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "cloud.depth.intrinsics.cx and cy are %g and %g; both must be finite.", message.cx(), message.cy()));
  }
  return CameraIntrinsics{message.fx(), message.fy(), message.cx(), message.cy()};
}

/// Points from the pixels of a depth image. Anything but a finite value above 0 is no measurement.
template <class Pixel>
std::vector<Eigen::Vector3f> back_project(std::string_view pixels, std::size_t width, const CameraIntrinsics& camera,
                                          double metres_per_step) {
  std::vector<Eigen::Vector3f> points(pixels.size() / sizeof(Pixel), Eigen::Vector3f::Constant(kNaN));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double z = metres_per_step * static_cast<double>(unpack<Pixel>(pixels, i));
    if (!(z > 0)) continue;
    const std::size_t row = i / width;
    const auto u = static_cast<double>(i - row * width);
    const auto v = static_cast<double>(row);
    points[i] =
        Eigen::Vector3d((u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z).template cast<float>();
  }
  return points;
}

absl::StatusOr<PointCloud> from_depth(const v1::DepthImage& message, double metres_per_unit) {
  if (absl::Status status = check_size("cloud.depth", message.width(), message.height()); !status.ok()) return status;
  const double scale = message.has_depth_scale() ? message.depth_scale() : 1;
  if (absl::Status status = check_positive("cloud.depth.depth_scale", scale); !status.ok()) return status;
  const absl::StatusOr<CameraIntrinsics> camera = to_intrinsics(message.intrinsics());
  if (!camera.ok()) return camera.status();
  const std::size_t count = std::size_t{message.width()} * message.height();
  const double metres_per_step = scale * metres_per_unit;
  PointCloud cloud;
  cloud.width = message.width();
  cloud.height = message.height();
  cloud.intrinsics = *camera;
  absl::Status status;
  switch (message.pixels_case()) {
    case v1::DepthImage::kUint16:
      status = check_bytes("cloud.depth.uint16", message.uint16(), count, sizeof(std::uint16_t));
      if (!status.ok()) return status;
      cloud.points = back_project<std::uint16_t>(message.uint16(), cloud.width, *camera, metres_per_step);
      return cloud;
    case v1::DepthImage::kFloat32:
      status = check_bytes("cloud.depth.float32", message.float32(), count, sizeof(float));
      if (!status.ok()) return status;
      cloud.points = back_project<float>(message.float32(), cloud.width, *camera, metres_per_step);
      return cloud;
    case v1::DepthImage::PIXELS_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("cloud.depth has no pixels; set uint16 or float32.");
}

absl::StatusOr<PointCloud> decode(const v1::PointCloud& message, double metres_per_unit, const RunControl& control) {
  switch (message.data_case()) {
    case v1::PointCloud::kPoints:
      return from_points(message.points(), metres_per_unit);
    case v1::PointCloud::kDepth:
      return from_depth(message.depth(), metres_per_unit);
    case v1::PointCloud::kPcd:
      return in_field("cloud.pcd", read_pcd(message.pcd(), metres_per_unit, kMaxCloudPoints, control));
    case v1::PointCloud::kPly:
      return in_field("cloud.ply", read_ply_cloud(message.ply(), metres_per_unit, kMaxCloudPoints, control));
    case v1::PointCloud::DATA_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("cloud has no data; set points, depth, pcd or ply.");
}

/// Whether all numbers are finite and at most `most` in size; without branches, so that the compiler vectorises it.
bool all_within(std::span<const Eigen::Vector3f> points, float most) {
  const float* const numbers = points.front().data();
  int beyond = 0;
  for (std::size_t i = 0; i < 3 * points.size(); ++i) beyond |= static_cast<int>(!(std::abs(numbers[i]) <= most));
  return beyond == 0;
}

/// Makes what is not finite NaN; INVALID_ARGUMENT for a point that is farther than any sensor sees.
absl::Status clean_points(std::vector<Eigen::Vector3f>& points) {
  constexpr auto kMost = static_cast<float>(kMaxCoordinateMetres);
  constexpr std::size_t kBlock = 64;
  for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
    const std::span block = std::span(points).subspan(begin, std::min(kBlock, points.size() - begin));
    if (all_within(block, kMost)) continue;
    for (Eigen::Vector3f& p : block) {
      if (!p.allFinite()) {
        p.setConstant(kNaN);
      } else if (p.cwiseAbs().maxCoeff() > kMost) {
        return absl::InvalidArgumentError(
            absl::StrFormat("cloud: point %d has a coordinate of %g m; the limit is %g m. Mark what was not measured "
                            "by NaN, and check cloud.unit.",
                            &p - points.data(), p.cwiseAbs().maxCoeff(), kMaxCoordinateMetres));
      }
    }
  }
  return absl::OkStatus();
}

/// Gives the normals of measured points exactly unit length.
absl::Status clean_normals(PointCloud& cloud) {
  for (std::size_t i = 0; i < cloud.normals.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const float length = cloud.normals[i].norm();
    if (!(length > 0.9F && length < 1.1F)) {
      return absl::InvalidArgumentError(
          absl::StrFormat("cloud: the normal of point %d has length %g; it must be 1. Leave the normals out to have "
                          "them estimated.",
                          i, length));
    }
    cloud.normals[i] /= length;
  }
  return absl::OkStatus();
}

absl::Status set_sensor_position(const v1::Vector3& message, double metres_per_unit, PointCloud& cloud) {
  cloud.sensor_position = metres_per_unit * Eigen::Vector3d(message.x(), message.y(), message.z());
  if (cloud.sensor_position.cwiseAbs().maxCoeff() <= kMaxCoordinateMetres && cloud.sensor_position.allFinite()) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrFormat("cloud.sensor_position is (%g, %g, %g); it must lie within %g m of the origin.", message.x(),
                      message.y(), message.z(), kMaxCoordinateMetres));
}

}  // namespace

absl::StatusOr<PointCloud> to_cloud(const v1::PointCloud& message, const RunControl& control) {
  const absl::StatusOr<double> metres = metres_per_unit("cloud.unit", message.unit());
  if (!metres.ok()) return metres.status();
  absl::StatusOr<PointCloud> cloud =
      decode_in_time("cloud", control, [&](const RunControl& limited) { return decode(message, *metres, limited); });
  if (!cloud.ok()) return cloud;
  if (control.stop.stop_requested()) return control.status();
  absl::Status status = clean_points(cloud->points);
  if (status.ok()) status = clean_normals(*cloud);
  if (status.ok() && message.has_sensor_position()) {
    status = set_sensor_position(message.sensor_position(), *metres, *cloud);
  }
  if (!status.ok()) return status;
  return cloud;
}

}  // namespace binpose::server

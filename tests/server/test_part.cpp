#include "tests/server/test_part.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace binpose::server {
namespace {

/// Axis-parallel box, millimetres.
struct Box {
  Eigen::Vector3d low, high;
};

/// The two boxes that make up the block.
const std::array<Box, 2> kBoxes = {Box{{0, 0, 0}, {60, 20, 20}}, Box{{0, 20, 0}, {20, 40, 12}}};

void append(std::string& bytes, const void* data, std::size_t size) {
  bytes.append(static_cast<const char*>(data), size);
}

void append_triangle(std::string& stl, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3f normal = (b - a).cross(c - a).normalized().cast<float>();
  append(stl, normal.data(), sizeof(normal));
  for (const Eigen::Vector3d& corner : {a, b, c}) {
    const Eigen::Vector3f vertex = corner.cast<float>();
    append(stl, vertex.data(), sizeof(vertex));
  }
  stl.append(2, '\0');
}

/// Distance along the ray from the origin to the box's surface.
std::optional<double> hit(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Array3d to_low = (box.low - origin).array() / direction.array();
  const Eigen::Array3d to_high = (box.high - origin).array() / direction.array();
  const double enter = to_low.min(to_high).maxCoeff();
  const double leave = to_low.max(to_high).minCoeff();
  if (enter > leave || leave < 0) return std::nullopt;
  return enter;
}

}  // namespace

std::string l_block_stl() {
  std::string stl(80, ' ');
  const std::uint32_t count = 24;
  append(stl, &count, sizeof(count));
  for (const Box& box : kBoxes) {
    for (int axis = 0; axis < 3; ++axis) {
      const int next = (axis + 1) % 3;
      const int last = (axis + 2) % 3;
      for (const bool top : {false, true}) {
        std::array<Eigen::Vector3d, 4> corners;
        for (int k = 0; k < 4; ++k) {
          corners[k][axis] = top ? box.high[axis] : box.low[axis];
          corners[k][next] = k == 1 || k == 2 ? box.high[next] : box.low[next];
          corners[k][last] = k >= 2 ? box.high[last] : box.low[last];
        }
        if (!top) std::swap(corners[1], corners[3]);
        append_triangle(stl, corners[0], corners[1], corners[2]);
        append_triangle(stl, corners[0], corners[2], corners[3]);
      }
    }
  }
  return stl;
}

v1::TrainRequest train_request(const std::string& id) {
  v1::TrainRequest request;
  request.set_id(id);
  request.mutable_mesh()->set_data(l_block_stl());
  request.mutable_mesh()->set_unit(v1::LENGTH_UNIT_MILLIMETRE);
  return request;
}

v1::PointCloud block_scan() {
  constexpr int kWidth = 320;
  constexpr int kHeight = 240;
  constexpr double kFocal = 600;
  constexpr double kCentreColumn = 160;
  constexpr double kCentreRow = 120;
  const Eigen::Isometry3d T_scene_model =
      Eigen::Translation3d(-20, -15, 400) * Eigen::AngleAxisd(1.5, Eigen::Vector3d(1, 0.7, 0.3).normalized());
  const Eigen::Isometry3d T_model_scene = T_scene_model.inverse();
  std::string pixels;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Eigen::Vector3d ray((u - kCentreColumn) / kFocal, (v - kCentreRow) / kFocal, 1);
      auto depth = std::numeric_limits<float>::quiet_NaN();
      for (const Box& box : kBoxes) {
        const auto distance = hit(box, T_model_scene.translation(), T_model_scene.linear() * ray);
        if (distance) depth = std::fmin(depth, static_cast<float>(*distance));
      }
      append(pixels, &depth, sizeof(depth));
    }
  }
  v1::PointCloud cloud;
  cloud.set_unit(v1::LENGTH_UNIT_MILLIMETRE);
  v1::DepthImage& image = *cloud.mutable_depth();
  image.set_width(kWidth);
  image.set_height(kHeight);
  image.set_float32(pixels);
  image.mutable_intrinsics()->set_fx(kFocal);
  image.mutable_intrinsics()->set_fy(kFocal);
  image.mutable_intrinsics()->set_cx(kCentreColumn);
  image.mutable_intrinsics()->set_cy(kCentreRow);
  return cloud;
}

v1::DetectRequest detect_request(const std::string& request_id, const std::string& model_id) {
  v1::DetectRequest request;
  request.set_request_id(request_id);
  request.add_model_ids(model_id);
  *request.mutable_cloud() = block_scan();
  return request;
}

}  // namespace binpose::server

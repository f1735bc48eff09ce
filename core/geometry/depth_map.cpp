#include "core/geometry/depth_map.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace binpose {
namespace {

constexpr double kMostPixels = 4e6;
constexpr std::size_t kPointsPerTask = 8192;

/// The point on a pixel's ray between its neighbours, or z = 0 unless most of them were measured on one surface.
Eigen::Vector3f between_neighbours(const DepthMap& map, int u, int v) {
  constexpr int kFewest = 5;
  float least = INFINITY, most = 0, sum = 0;
  int count = 0;
  for (int row = std::max(0, v - 1); row <= std::min(map.height - 1, v + 1); ++row) {
    for (int column = std::max(0, u - 1); column <= std::min(map.width - 1, u + 1); ++column) {
      const float z = map.pixels[static_cast<std::size_t>(row) * map.width + column].position.z();
      if (!(z > 0)) continue;
      least = std::min(least, z);
      most = std::max(most, z);
      sum += 1 / z;
      ++count;
    }
  }
  if (count < kFewest || most - least > 3 * map.pixel_size) return Eigen::Vector3f::Zero();
  const float z = static_cast<float>(count) / sum;
  return {(static_cast<float>(u) - map.cx) * z / map.focal, (static_cast<float>(v) - map.cy) * z / map.focal, z};
}

/// Scattered points leave single pixels empty that lie on a surface all the same.
void fill_specks(DepthMap& map, const RunControl& control) {
  std::vector<std::vector<std::pair<int, Eigen::Vector3f>>> filled(map.height);
  parallel_for(map.height, control.threads, [&](int v) {
    if (control.interrupted()) return;
    for (int u = 0; u < map.width; ++u) {
      const int i = v * map.width + u;
      if (map.measured(i)) continue;
      const Eigen::Vector3f point = between_neighbours(map, u, v);
      if (point.z() > 0) filled[v].emplace_back(i, point);
    }
  });
  for (const auto& row : filled) {
    for (const auto& [i, point] : row) map.pixels[i].position = point;
  }
}

/// Sets each pixel to the nearest of the points that fall on it, the first of equals.
void take_nearest(const SensorView& view, const RunControl& control, DepthMap& map) {
  std::vector<int> pixel_of_point(view.points.size());
  parallel_for_blocks(view.points.size(), kPointsPerTask, control.threads,
                      [&](std::size_t i) { pixel_of_point[i] = map.pixel_of(view.points[i]); });
  // Each thread takes the points of a band of its own.
  parallel_for(control.threads, control.threads, [&](int band) {
    const std::size_t count = map.pixels.size();
    const auto first = static_cast<int>(count * band / control.threads);
    const auto end = static_cast<int>(count * (band + 1) / control.threads);
    for (std::size_t i = 0; i < view.points.size() && !control.interrupted_at(i); ++i) {
      const int pixel = pixel_of_point[i];
      if (pixel < first || pixel >= end) continue;
      const Eigen::Vector3f& p = view.points[i];
      if (map.measured(pixel) && map.pixels[pixel].position.z() <= p.z()) continue;
      map.pixels[pixel].position = p;
      if (view.normals.empty()) continue;
      const Eigen::Vector3f& n = view.normals[i];
      const float sign = n.dot(p) > 0 ? -1.0F : 1.0F;
      map.pixels[pixel].normal =
          n.allFinite() && n.norm() > 0.5F ? Eigen::Vector3f(sign * n.normalized()) : Eigen::Vector3f::Zero();
    }
  });
}

}  // namespace

DepthMap depth_map(const SensorView& view, double pixel_size, const RunControl& control) {
  const TangentBox& window = view.window;
  const double width_tan = window.high_x - window.low_x, height_tan = window.high_y - window.low_y;
  double pixel_tan = pixel_size / view.median_depth;
  pixel_tan = std::max({pixel_tan, std::sqrt(width_tan * height_tan / kMostPixels),
                        std::max(width_tan, height_tan) / (0.1 * kMostPixels), 1e-9});

  DepthMap map;
  map.T_scene_view = view.T_scene_view;
  map.focal = static_cast<float>(1 / pixel_tan);
  map.pixel_size = static_cast<float>(pixel_tan * view.median_depth);
  map.cx = -window.low_x * map.focal;
  map.cy = -window.low_y * map.focal;
  map.width = static_cast<int>(std::lround(width_tan / pixel_tan)) + 1;
  map.height = static_cast<int>(std::lround(height_tan / pixel_tan)) + 1;
  const std::size_t count = static_cast<std::size_t>(map.width) * map.height;
  map.pixels.assign(count, {Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()});
  map.background.assign(count, 0);
  if (control.interrupted()) return map;
  take_nearest(view, control, map);
  if (view.normals.empty()) fill_specks(map, control);
  return map;
}

}  // namespace binpose

#include "core/geometry/depth_map.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "core/parallel.h"

namespace binpose {
namespace {

constexpr double kMostPixels = 4e6;
/// Points farther than this off the viewing direction are left out: tan 72 degrees.
constexpr float kWidestTangent = 3;
constexpr std::size_t kEnoughForDirection = 20000;  // points
constexpr std::size_t kEnoughForDepth = 10000;
constexpr std::size_t kPointsPerTask = 8192;

absl::Status check_cloud(const PointCloud& cloud) {
  const std::size_t count = static_cast<std::size_t>(cloud.width) * cloud.height;
  if (count != cloud.points.size()) {
    return absl::InvalidArgumentError(absl::StrFormat("cloud has %d points; width x height is %d x %d = %d.",
                                                      cloud.points.size(), cloud.width, cloud.height, count));
  }
  if (count == 0) return absl::InvalidArgumentError("cloud has 0 points; it must have at least 1.");
  if (!cloud.normals.empty() && cloud.normals.size() != count) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "cloud has %d normals for %d points; it must have one each, or none.", cloud.normals.size(), count));
  }
  if (!cloud.sensor_position.allFinite()) {
    return absl::InvalidArgumentError("cloud sensor_position is not a finite number.");
  }
  return absl::OkStatus();
}

/// Sum of the unit directions of every n-th point that was measured.
Eigen::Vector3d viewing_direction(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& sensor,
                                  std::size_t step) {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); i += step) {
    if (points[i].allFinite() && points[i] != sensor) direction += (points[i] - sensor).normalized().cast<double>();
  }
  return direction;
}

/// Of every n-th point.
float median_depth(const std::vector<Eigen::Vector3f>& points) {
  const std::size_t step = 1 + points.size() / kEnoughForDepth;
  std::vector<float> depths;
  depths.reserve(points.size() / step + 1);
  for (std::size_t i = 0; i < points.size(); i += step) depths.push_back(points[i].z());
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

/// Side of a coarse cell over the root of the median count of points in it.
float point_spacing(const std::vector<Eigen::Vector3f>& points, const TangentBox& window, float depth) {
  const float area = std::max((window.high_x - window.low_x) * (window.high_y - window.low_y), 1e-12F);
  const float cell = 5 * std::sqrt(area / static_cast<float>(points.size()));
  const int columns = static_cast<int>((window.high_x - window.low_x) / cell) + 1;
  const int rows = static_cast<int>((window.high_y - window.low_y) / cell) + 1;
  if (static_cast<double>(columns) * rows > kMostPixels) return depth * cell / 5;  // all points on a line
  std::vector<int> counts(static_cast<std::size_t>(columns) * rows, 0);
  for (const Eigen::Vector3f& p : points) {
    const int column = std::min(columns - 1, static_cast<int>((p.x() / p.z() - window.low_x) / cell));
    const int row = std::min(rows - 1, static_cast<int>((p.y() / p.z() - window.low_y) / cell));
    ++counts[static_cast<std::size_t>(row) * columns + column];
  }
  std::erase(counts, 0);
  const auto middle = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
  std::nth_element(counts.begin(), middle, counts.end());
  return depth * cell / std::sqrt(static_cast<float>(*middle));
}

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

}  // namespace

TangentBox window_of(const std::vector<Eigen::Vector3f>& points) {
  TangentBox window;
  for (const Eigen::Vector3f& p : points) {
    const float x = p.x() / p.z(), y = p.y() / p.z();
    window.low_x = std::min(window.low_x, x);
    window.high_x = std::max(window.high_x, x);
    window.low_y = std::min(window.low_y, y);
    window.high_y = std::max(window.high_y, y);
  }
  return window;
}

absl::StatusOr<SensorView> sensor_view(const PointCloud& cloud, const RunControl& control) {
  if (absl::Status status = check_cloud(cloud); !status.ok()) return status;
  const Eigen::Vector3f sensor = cloud.sensor_position.cast<float>();
  Eigen::Vector3d direction = viewing_direction(cloud.points, sensor, 1 + cloud.points.size() / kEnoughForDirection);
  if (!(direction.norm() > 0)) direction = viewing_direction(cloud.points, sensor, 1);
  if (control.stop.stop_requested()) return control.status();
  if (!(direction.norm() > 0)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "cloud has no measurement among its %d points; at least one must have finite x, y, z away from the sensor.",
        cloud.points.size()));
  }

  SensorView view;
  view.is_grid = cloud.height > 1;
  view.T_scene_view.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction.normalized()).toRotationMatrix();
  view.T_scene_view.translation() = cloud.sensor_position;
  const Eigen::Matrix3f R_view_scene = view.T_scene_view.linear().transpose().cast<float>();
  view.points.resize(cloud.points.size());
  parallel_for_blocks(cloud.points.size(), kPointsPerTask, control.threads, [&](std::size_t i) {
    if (control.stop.stop_requested()) return;
    const Eigen::Vector3f p = R_view_scene * (cloud.points[i] - sensor);
    const bool seen =
        p.allFinite() && p.z() > 1e-6F && std::max(std::abs(p.x()), std::abs(p.y())) <= kWidestTangent * p.z();
    view.points[i] = seen ? p : Eigen::Vector3f(0, 0, 0);
  });
  if (control.stop.stop_requested()) return control.status();
  std::size_t seen_count = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (i % 1024 == 0 && control.stop.stop_requested()) return control.status();
    if (!(view.points[i].z() > 0)) continue;
    view.points[seen_count++] = view.points[i];
    if (!cloud.normals.empty()) view.normals.emplace_back(R_view_scene * cloud.normals[i]);
  }
  view.points.resize(seen_count);
  if (view.points.empty()) {
    return absl::InvalidArgumentError(
        absl::StrFormat("cloud has no point in front of the sensor at (%g, %g, %g) m; set sensor_position to where it "
                        "was measured from.",
                        cloud.sensor_position.x(), cloud.sensor_position.y(), cloud.sensor_position.z()));
  }
  if (control.stop.stop_requested()) return control.status();
  view.window = window_of(view.points);
  view.median_depth = median_depth(view.points);
  if (control.stop.stop_requested()) return control.status();
  view.spacing = point_spacing(view.points, view.window, view.median_depth);
  return view;
}

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
  for (std::size_t i = 0; i < view.points.size() && !control.interrupted_at(i); ++i) {
    const int pixel = map.pixel_of(view.points[i]);
    if (pixel < 0 || (map.measured(pixel) && map.pixels[pixel].position.z() <= view.points[i].z())) continue;
    map.pixels[pixel].position = view.points[i];
    if (view.normals.empty()) continue;
    const Eigen::Vector3f& n = view.normals[i];
    const float sign = n.dot(view.points[i]) > 0 ? -1.0F : 1.0F;
    map.pixels[pixel].normal =
        n.allFinite() && n.norm() > 0.5F ? Eigen::Vector3f(sign * n.normalized()) : Eigen::Vector3f::Zero();
  }
  if (view.normals.empty()) fill_specks(map, control);
  return map;
}

}  // namespace binpose

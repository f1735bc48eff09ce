#include "core/geometry/sensor_view.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "absl/strings/str_format.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// Points farther than this off the viewing direction are left out: tan 72 degrees.
constexpr float kWidestTangent = 3;
constexpr std::size_t kEnoughForDirection = 20000;  // points
constexpr std::size_t kEnoughForDepth = 10000;
constexpr std::size_t kPointsPerBlock = 8192;

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

/// The measured points of a cloud in the view frame.
struct PointsInView {
  const PointCloud& cloud;
  Eigen::Matrix3f R_view_scene;
  Eigen::Vector3f sensor;  // scene frame

  /// Calls `use(i, point)` for each of a block of the cloud's points that lies in front of the sensor. Returns how many
  /// others were measured.
  template <typename Use>
  std::size_t for_each(std::size_t block, const Use& use) const {
    std::size_t others = 0;
    const std::size_t end = std::min(cloud.points.size(), (block + 1) * kPointsPerBlock);
    for (std::size_t i = block * kPointsPerBlock; i < end; ++i) {
      const Eigen::Vector3f p = R_view_scene * (cloud.points[i] - sensor);
      if (!p.allFinite()) continue;
      const bool seen = p.z() > 1e-6F && std::max(std::abs(p.x()), std::abs(p.y())) <= kWidestTangent * p.z();
      if (seen) use(i, p);
      others += static_cast<std::size_t>(!seen && p.squaredNorm() > 0);
    }
    return others;
  }
  Eigen::Vector3f normal(std::size_t i) const { return R_view_scene * cloud.normals[i]; }
  int block_count() const { return static_cast<int>((cloud.points.size() + kPointsPerBlock - 1) / kPointsPerBlock); }
};

/// Sets the points, their normals and window: each block where it lies in the cloud, then all moved together.
void take_points(const PointCloud& cloud, const RunControl& control, SensorView& view) {
  const PointsInView source = {cloud, view.T_scene_view.linear().transpose().cast<float>(),
                               view.T_scene_view.translation().cast<float>()};
  std::vector<std::size_t> counts(source.block_count(), 0), others(source.block_count(), 0);
  std::vector<TangentBox> windows(source.block_count());
  view.points.resize(cloud.points.size());
  view.normals.resize(cloud.normals.size());
  parallel_for(source.block_count(), control.threads, [&](int b) {
    if (control.stop.stop_requested()) return;
    const std::size_t first = b * kPointsPerBlock;
    others[b] = source.for_each(b, [&](std::size_t i, const Eigen::Vector3f& p) {
      const std::size_t to = first + counts[b]++;
      view.points[to] = p;
      if (!cloud.normals.empty()) view.normals[to] = source.normal(i);
      windows[b].extend(p);
    });
  });
  std::size_t total = 0;
  for (int b = 0; b < source.block_count(); ++b) {
    const auto move_up = [&](std::vector<Eigen::Vector3f>& values) {
      const auto first = values.begin() + static_cast<std::ptrdiff_t>(b * kPointsPerBlock);
      const auto to = values.begin() + static_cast<std::ptrdiff_t>(total);
      if (first != to) std::copy_n(first, counts[b], to);
    };
    move_up(view.points);
    if (!cloud.normals.empty()) move_up(view.normals);
    view.window.extend(windows[b]);
    total += counts[b];
  }
  const auto behind = static_cast<double>(std::accumulate(others.begin(), others.end(), std::size_t{0}));
  view.share_behind = behind / std::max(1.0, behind + static_cast<double>(total));
  view.points.resize(total);
  if (!cloud.normals.empty()) view.normals.resize(total);
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

/// How many points fall into each cell of a grid over a window, row by row, those without any left out.
std::vector<int> cell_counts(const std::vector<Eigen::Vector3f>& points, const TangentBox& window, float cell,
                             int columns, int rows, const RunControl& control) {
  std::vector<std::vector<int>> parts(control.threads);  // sums of whole numbers: the same however they are parted
  parallel_for(control.threads, control.threads, [&](int part) {
    std::vector<int>& counts = parts[part];
    counts.assign(static_cast<std::size_t>(columns) * rows, 0);
    const std::size_t end = points.size() * (part + 1) / control.threads;
    for (std::size_t i = points.size() * part / control.threads; i < end; ++i) {
      if (i % 1024 == 0 && control.stop.stop_requested()) return;
      const Eigen::Vector3f& p = points[i];
      const int column = std::min(columns - 1, static_cast<int>((p.x() / p.z() - window.low_x) / cell));
      const int row = std::min(rows - 1, static_cast<int>((p.y() / p.z() - window.low_y) / cell));
      ++counts[static_cast<std::size_t>(row) * columns + column];
    }
  });
  for (std::size_t part = 1; part < parts.size(); ++part) {
    std::transform(parts[part].begin(), parts[part].end(), parts[0].begin(), parts[0].begin(), std::plus<>());
  }
  std::erase(parts[0], 0);
  return std::move(parts[0]);
}

/// Side of a coarse cell over the root of the median count of points in it.
float point_spacing(const std::vector<Eigen::Vector3f>& points, const TangentBox& window, float depth,
                    const RunControl& control) {
  constexpr double kMostCells = 4e6;
  const float area = std::max((window.high_x - window.low_x) * (window.high_y - window.low_y), 1e-12F);
  const float cell = 5 * std::sqrt(area / static_cast<float>(points.size()));
  const int columns = static_cast<int>((window.high_x - window.low_x) / cell) + 1;
  const int rows = static_cast<int>((window.high_y - window.low_y) / cell) + 1;
  if (static_cast<double>(columns) * rows > kMostCells) return depth * cell / 5;  // all points on a line
  std::vector<int> counts = cell_counts(points, window, cell, columns, rows, control);
  if (counts.empty()) return 0;
  const auto middle = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
  std::nth_element(counts.begin(), middle, counts.end());
  return depth * cell / std::sqrt(static_cast<float>(*middle));
}

}  // namespace

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
  view.T_scene_view.linear() = turn_of_z_to<double>(direction.normalized()).toRotationMatrix();
  view.T_scene_view.translation() = cloud.sensor_position;
  take_points(cloud, control, view);
  if (control.stop.stop_requested()) return control.status();
  if (view.points.empty()) {
    return absl::InvalidArgumentError(
        absl::StrFormat("cloud has no point in front of the sensor at (%g, %g, %g) m; set sensor_position to where it "
                        "was measured from.",
                        cloud.sensor_position.x(), cloud.sensor_position.y(), cloud.sensor_position.z()));
  }
  view.median_depth = median_depth(view.points);
  view.spacing = point_spacing(view.points, view.window, view.median_depth, control);
  if (control.stop.stop_requested()) return control.status();
  return view;
}

}  // namespace binpose

#include "core/geometry/hidden_surfaces.h"

#include <algorithm>
#include <vector>

#include "core/parallel.h"

namespace binpose {
namespace {

constexpr float kClearly = 3.0F;               // pixel widths
constexpr float kBehindClosing = 0.75F;        // pixel widths
constexpr std::size_t kEnoughPoints = 20'000;  // to tell a share

/// Each pixel's extreme over itself and its 8 neighbours, as far as they are in the image: first over rows, then over
/// columns.
template <typename Pick>
std::vector<float> over_neighbours(const std::vector<float>& values, const DepthMap& map, const Pick& pick,
                                   const RunControl& control) {
  const int width = map.width, height = map.height;
  std::vector<float> in_rows(values.size()), result(values.size());
  const auto for_each_pixel = [&](const auto& use) {
    parallel_for(height, control.threads, [&](int v) {
      if (control.interrupted()) return;
      for (int u = 0; u < width; ++u) use(u, v, v * width + u);
    });
  };
  for_each_pixel([&](int u, int, int i) {
    in_rows[i] = pick(values[i], pick(values[i - (u > 0 ? 1 : 0)], values[i + (u + 1 < width ? 1 : 0)]));
  });
  for_each_pixel([&](int, int v, int i) {
    result[i] = pick(in_rows[i], pick(in_rows[v > 0 ? i - width : i], in_rows[v + 1 < height ? i + width : i]));
  });
  return result;
}

}  // namespace

double hidden_share(const SensorView& view, const DepthMap& map) {
  const std::size_t step = 1 + view.points.size() / kEnoughPoints;
  std::size_t hidden = 0, count = 0;
  for (std::size_t i = 0; i < view.points.size(); i += step) {
    const int pixel = map.pixel_of(view.points[i]);
    if (pixel < 0) continue;
    ++count;
    if (view.points[i].z() > map.pixels[pixel].position.z() + kClearly * map.pixel_size) ++hidden;
  }
  return static_cast<double>(hidden) / static_cast<double>(std::max<std::size_t>(1, count));
}

void hide_behind_gaps(DepthMap& map, const RunControl& control) {
  std::vector<float> nearness(map.pixels.size(), 0);
  for (std::size_t i = 0; i < nearness.size(); ++i) {
    if (map.measured(static_cast<int>(i))) nearness[i] = 1 / map.pixels[i].position.z();
  }
  const auto larger = [](float a, float b) { return std::max(a, b); };
  const auto smaller = [](float a, float b) { return std::min(a, b); };
  const std::vector<float> closed =
      over_neighbours(over_neighbours(nearness, map, larger, control), map, smaller, control);
  if (control.interrupted()) return;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const float z = map.pixels[i].position.z();
    if (closed[i] * (z - kBehindClosing * map.pixel_size) > 1) map.pixels[i] = {{0, 0, 0}, {0, 0, 0}};
  }
}

SensorView from_behind(const SensorView& view, const RunControl& control) {
  PointCloud cloud;  // in the view's frame
  cloud.points = view.points;
  cloud.normals = view.normals;
  cloud.width = static_cast<std::uint32_t>(view.points.size());
  cloud.height = 1;
  cloud.sensor_position.z() = 2 * static_cast<double>(view.median_depth);
  absl::StatusOr<SensorView> behind = sensor_view(cloud, control);
  if (!behind.ok()) return {};
  behind->T_scene_view = view.T_scene_view * behind->T_scene_view;
  return *std::move(behind);
}

}  // namespace binpose

#include "core/geometry/hidden_surfaces.h"

#include <algorithm>
#include <utility>

namespace binpose {
namespace {

constexpr float kClearly = 3.0F;               // pixel widths
constexpr float kBehindClosing = 0.75F;        // pixel widths
constexpr std::size_t kEnoughPoints = 20'000;  // to tell a share

/// Each value's extreme over itself and its 8 neighbours, as far as they are in the image.
template <typename Pick>
std::vector<float> over_neighbours(const std::vector<float>& values, int width, int height, const Pick& pick) {
  std::vector<float> in_rows(values.size()), result(values.size());
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const int i = v * width + u;
      in_rows[i] = pick(values[i], pick(values[i - (u > 0 ? 1 : 0)], values[i + (u + 1 < width ? 1 : 0)]));
    }
  }
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const int i = v * width + u;
      result[i] = pick(in_rows[i], pick(in_rows[v > 0 ? i - width : i], in_rows[v + 1 < height ? i + width : i]));
    }
  }
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

void hide_behind_gaps(DepthMap& map) {
  std::vector<float> nearness(map.pixels.size(), 0);
  for (std::size_t i = 0; i < nearness.size(); ++i) {
    if (map.measured(static_cast<int>(i))) nearness[i] = 1 / map.pixels[i].position.z();
  }
  const auto widen = [&](const std::vector<float>& values, auto pick) {
    return over_neighbours(values, map.width, map.height, pick);
  };
  const std::vector<float> closed = widen(widen(nearness, [](float a, float b) { return std::max(a, b); }),
                                          [](float a, float b) { return std::min(a, b); });
  for (std::size_t i = 0; i < closed.size(); ++i) {
    Eigen::Vector3f& p = map.pixels[i].position;
    if (closed[i] * (p.z() - kBehindClosing * map.pixel_size) > 1) map.pixels[i] = {{0, 0, 0}, {0, 0, 0}};
  }
}

}  // namespace binpose

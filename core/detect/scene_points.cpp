#include "core/detect/scene_points.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace binpose {
namespace {

/// The pixel nearest the middle of a block that may take part in matching, or -1.
int middle_pixel(const DepthMap& map, int first_u, int first_v, int block_size) {
  int best = -1, best_offset = 4 * block_size;
  for (int v = first_v; v < std::min(map.height, first_v + block_size); ++v) {
    for (int u = first_u; u < std::min(map.width, first_u + block_size); ++u) {
      const int pixel = v * map.width + u;
      const int offset = std::abs(2 * (u - first_u) + 1 - block_size) + std::abs(2 * (v - first_v) + 1 - block_size);
      if (offset >= best_offset || !map.has_normal(pixel) || map.background[pixel]) continue;
      best = pixel;
      best_offset = offset;
    }
  }
  return best;
}

}  // namespace

ScenePoints down_sample(const DepthMap& map, int block_size) {
  ScenePoints scene;
  scene.block_size = block_size;
  scene.columns = (map.width + block_size - 1) / block_size;
  scene.rows = (map.height + block_size - 1) / block_size;
  scene.first.reserve(static_cast<std::size_t>(scene.columns) * scene.rows + 1);
  for (int row = 0; row < scene.rows; ++row) {
    for (int column = 0; column < scene.columns; ++column) {
      const int pixel = middle_pixel(map, column * block_size, row * block_size, block_size);
      scene.first.push_back(static_cast<int>(scene.points.size()));
      if (pixel >= 0) scene.points.push_back(map.pixels[pixel]);
    }
  }
  scene.first.push_back(static_cast<int>(scene.points.size()));
  return scene;
}

std::vector<int> start_points(const ScenePoints& scene, double share) {
  std::vector<int> starts;
  for (int row = 0; row < scene.rows; ++row) {
    for (int column = 0; column < scene.columns; ++column) {
      const int index = scene.at_block(row * scene.columns + column);
      // A two-dimensional low-discrepancy pattern: every window of the image holds its share.
      const double phase = std::fmod(0.7548776662466927 * column + 0.5698402909980532 * row, 1.0);
      if (index >= 0 && phase < share) starts.push_back(index);
    }
  }
  return starts;
}

}  // namespace binpose

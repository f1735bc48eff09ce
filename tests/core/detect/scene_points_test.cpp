#include "core/detect/scene_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

/// A block over a floor; every ninth column and a rectangle are taken out of matching.
DepthMap holey_map() {
  const testing::PlacedMesh bodies[] = {{testing::l_block(), testing::pose(30, {1, 2, 3}, {0, 0, 0.45})}};
  DepthMap map = testing::scan_map(bodies, {}, 0.1);
  for (int v = 0; v < map.height; ++v) {
    for (int u = 0; u < map.width; ++u) {
      if (u % 9 == 0) map.background[v * map.width + u] = 1;
      if (u > 40 && u < 60 && v > 30 && v < 50) map.pixels[v * map.width + u].normal.setZero();
    }
  }
  return map;
}

TEST(DownSample, KeepsPerBlockTheUsablePixelNearestItsMiddle) {
  const DepthMap map = holey_map();
  for (const int block : {1, 3, 4}) {
    const ScenePoints scene = down_sample(map, block);
    ASSERT_EQ(scene.first.size(), static_cast<std::size_t>(scene.columns) * scene.rows + 1);
    // Distance of each block's nearest usable pixel from the middle, in half pixels.
    std::vector<int> least(scene.first.size() - 1, 1000);
    const auto offset = [&](int u, int v) {
      return std::abs(2 * (u % block) + 1 - block) + std::abs(2 * (v % block) + 1 - block);
    };
    for (int v = 0; v < map.height; ++v) {
      for (int u = 0; u < map.width; ++u) {
        const int i = v * map.width + u;
        if (!map.has_normal(i) || map.background[i]) continue;
        int& nearest = least[static_cast<std::size_t>(v / block) * scene.columns + u / block];
        nearest = std::min(nearest, offset(u, v));
      }
    }
    for (std::size_t b = 0; b < least.size(); ++b) {
      ASSERT_EQ(scene.at_block(b) < 0, least[b] == 1000);
      if (scene.at_block(b) < 0) continue;
      const SurfacePoint& point = scene.points[scene.at_block(b)];
      const int pixel = map.pixel_of(point.position);
      EXPECT_EQ(point.position, map.pixels[pixel].position);
      EXPECT_EQ(point.normal, map.pixels[pixel].normal);
      EXPECT_EQ(offset(pixel % map.width, pixel / map.width), least[b]);
    }
  }
}

TEST(StartPoints, AreTheWantedShareEverywhere) {
  const ScenePoints scene = down_sample(testing::scan_map({}, {}, 0.1), 2);
  for (const double share : {0.05, 0.2, 0.5, 1.0}) {
    const std::vector<int> starts = start_points(scene, share);
    EXPECT_TRUE(std::is_sorted(starts.begin(), starts.end()));
    EXPECT_EQ(std::adjacent_find(starts.begin(), starts.end()), starts.end());
    const double count = static_cast<double>(scene.points.size());
    EXPECT_NEAR(static_cast<double>(starts.size()) / count, share, 0.02);
    // Each quarter of the image holds a quarter of them.
    int upper_left = 0;
    for (const int start : starts) {
      const auto& p = scene.points[start].position;
      upper_left += static_cast<int>(p.x() < 0 && p.y() < 0);
    }
    EXPECT_NEAR(upper_left, 0.25 * static_cast<double>(starts.size()), 0.03 * share * count);
  }
}

}  // namespace
}  // namespace binpose

#include "core/geometry/hidden_surfaces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

const Pose kPlace(Eigen::Translation3d(0.02, -0.01, 0.5));

SensorView one_side() {
  const testing::PlacedMesh block{testing::l_block(), kPlace};
  PointCloud scan = testing::render({&block, 1}, {});
  return sensor_view(testing::scattered(std::move(scan.points))).value();
}

int count_measured(const DepthMap& map) {
  int count = 0;
  for (std::size_t i = 0; i < map.pixels.size(); ++i) count += map.measured(static_cast<int>(i)) ? 1 : 0;
  return count;
}

TEST(HiddenSurfaces, AreManyWhereACloudHoldsAllSidesAndFewInAScan) {
  const SensorView all = sensor_view(testing::all_sides(testing::l_block(), kPlace, 0.003)).value(), one = one_side();
  EXPECT_GT(hidden_share(all, depth_map(all, 1.2 * all.spacing)), 0.2);
  EXPECT_LT(hidden_share(one, depth_map(one, 1.2 * one.spacing)), 0.05);
}

TEST(HiddenSurfaces, DoNotShowThroughGapsOfNearerOnes) {
  // A wall of points 4 mm apart, 40 mm in front of a closed one.
  std::vector<Eigen::Vector3f> points;
  for (int y = -20; y <= 20; ++y) {
    for (int x = -20; x <= 20; ++x) {
      const auto u = static_cast<float>(x), v = static_cast<float>(y);
      points.emplace_back(0.002F * u, 0.002F * v, 0.54F);
      if (x % 2 == 0 && y % 2 == 0) points.emplace_back(0.002F * u, 0.002F * v, 0.5F);
    }
  }
  DepthMap map = depth_map(sensor_view(testing::scattered(std::move(points))).value(), 0.0022);
  const auto count_far = [&] {
    int far = 0;
    for (const SurfacePoint& pixel : map.pixels) far += pixel.position.z() > 0.52F ? 1 : 0;
    return far;
  };
  EXPECT_GT(count_far(), 300);
  hide_behind_gaps(map);
  EXPECT_LT(count_far(), 100) << "but for the rim, beyond which nothing is nearer";
}

TEST(HiddenSurfaces, AreNoneOnOneSlantedSurfaceOrBehindAWideHole) {
  std::vector<Eigen::Vector3f> points;
  for (int y = -30; y <= 30; ++y) {
    for (int x = -30; x <= 30; ++x) {
      const auto u = static_cast<float>(x), v = static_cast<float>(y);
      const bool in_hole = std::abs(x) < 5 && std::abs(y) < 5;
      points.emplace_back(0.002F * u, 0.002F * v, 0.5F + 0.002F * u + (in_hole ? 0.03F : 0.0F));
    }
  }
  DepthMap map = depth_map(sensor_view(testing::scattered(std::move(points))).value(), 0.0022);
  const int before = count_measured(map);
  hide_behind_gaps(map);
  EXPECT_GT(count_measured(map), 0.97 * before);
}

TEST(HiddenSurfaces, ComeFirstFromBehind) {
  const SensorView view = sensor_view(testing::all_sides(testing::l_block(), kPlace, 0.003)).value();
  const SensorView behind = from_behind(view);
  ASSERT_EQ(behind.points.size(), view.points.size());
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const Eigen::Vector3d p = view.T_scene_view * view.points[i].cast<double>();
    EXPECT_LT((behind.T_scene_view * behind.points[i].cast<double>() - p).norm(), 1e-6) << "the same place";
  }
  EXPECT_NEAR(behind.median_depth, view.median_depth, 0.03F);
  const auto mean_z = [](const DepthMap& map) {  // of what comes first, in the scene
    double sum = 0;
    for (std::size_t i = 0; i < map.pixels.size(); ++i) {
      if (map.measured(static_cast<int>(i))) sum += (map.T_scene_view * map.pixels[i].position.cast<double>()).z();
    }
    return sum / count_measured(map);
  };
  const double thickness = 0.02;  // nearly the block's
  EXPECT_GT(mean_z(depth_map(behind, 0.004)), mean_z(depth_map(view, 0.004)) + thickness);
}

}  // namespace
}  // namespace binpose

#include "core/geometry/hidden_surfaces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/train/sample_surface.h"
#include "tests/support/ray_cast.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

const Eigen::Vector3f kPlace(0.02F, -0.01F, 0.5F);

PointCloud scattered(std::vector<Eigen::Vector3f> points) {
  PointCloud cloud;
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.height = 1;
  cloud.points = std::move(points);
  return cloud;
}

/// Points all over a block in the sensor's view, `spacing` apart.
SensorView all_sides(float spacing) {
  std::vector<Eigen::Vector3f> points;
  for (const SurfacePoint& point : thin_evenly(scatter(testing::l_block(), spacing / 4), spacing)) {
    points.push_back(point.position + kPlace);
  }
  return sensor_view(scattered(std::move(points))).value();
}

SensorView one_side() {
  testing::PlacedMesh block{testing::l_block(), Pose::Identity()};
  block.T_scene_mesh.translation() = kPlace.cast<double>();
  PointCloud scan = testing::render({&block, 1}, {});
  return sensor_view(scattered(std::move(scan.points))).value();
}

int count_measured(const DepthMap& map) {
  int count = 0;
  for (std::size_t i = 0; i < map.pixels.size(); ++i) count += map.measured(static_cast<int>(i)) ? 1 : 0;
  return count;
}

TEST(HiddenSurfaces, AreManyWhereACloudHoldsAllSidesAndFewInAScan) {
  const SensorView all = all_sides(0.003F), one = one_side();
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
  DepthMap map = depth_map(sensor_view(scattered(std::move(points))).value(), 0.0022);
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
  DepthMap map = depth_map(sensor_view(scattered(std::move(points))).value(), 0.0022);
  const int before = count_measured(map);
  hide_behind_gaps(map);
  EXPECT_GT(count_measured(map), 0.97 * before);
}

}  // namespace
}  // namespace binpose

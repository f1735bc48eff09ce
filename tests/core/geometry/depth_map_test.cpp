#include "core/geometry/depth_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/scenes/random.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

PointCloud block_over_floor() {
  Pose T_scene_part = Pose::Identity();
  T_scene_part.translation() = Eigen::Vector3d(-0.02, -0.03, 0.46);
  const testing::PlacedMesh bodies[] = {{testing::l_block(), T_scene_part}};
  testing::PinholeSensor sensor;
  sensor.width = 160;
  sensor.height = 120;
  sensor.focal = 300;
  return testing::render(bodies, sensor);
}

TEST(DepthMap, HoldsTheNearestPointOfEachPixel) {
  const SensorView view = *sensor_view(block_over_floor());
  const DepthMap map = depth_map(view, 0.004);  // several points a pixel
  std::vector<float> nearest(map.pixels.size(), 0);
  for (const Vector3f& p : view.points) {
    const int u = static_cast<int>(std::floor(map.focal * p.x() / p.z() + map.cx + 0.5F));
    const int v = static_cast<int>(std::floor(map.focal * p.y() / p.z() + map.cy + 0.5F));
    ASSERT_TRUE(u >= 0 && v >= 0 && u < map.width && v < map.height) << "every point has a pixel";
    float& z = nearest[static_cast<std::size_t>(v) * map.width + u];
    z = z == 0 ? p.z() : std::min(z, p.z());
  }
  for (std::size_t i = 0; i < nearest.size(); ++i) ASSERT_EQ(map.pixels[i].position.z(), nearest[i]) << i;
}

/// A wall at 1 m with a point each 4 mm but the middle one; from `step_column` on it lies `step` deeper.
DepthMap wall_with_a_hole(int step_column, float step) {
  std::vector<Vector3f> points;
  for (int v = -10; v <= 10; ++v) {
    for (int u = -10; u <= 10; ++u) {
      const float z = 1 + (u >= step_column ? step : 0);
      if (u != 0 || v != 0) {
        points.emplace_back(0.004F * static_cast<float>(u) * z, 0.004F * static_cast<float>(v) * z, z);
      }
    }
  }
  return depth_map(*sensor_view(testing::scattered(points)), 0.004);
}

int measured_count(const DepthMap& map) {
  int count = 0;
  for (int i = 0; i < map.width * map.height; ++i) count += map.measured(i) ? 1 : 0;
  return count;
}

TEST(DepthMap, FillsASinglePixelBetweenNeighboursOfOneSurface) {
  const DepthMap whole = wall_with_a_hole(100, 0);
  EXPECT_EQ(measured_count(whole), 441);
  for (const SurfacePoint& pixel : whole.pixels) {
    EXPECT_TRUE(pixel.position.z() == 0 || std::abs(pixel.position.z() - 1) < 1e-3F);
  }
}

TEST(DepthMap, LeavesAPixelEmptyAtADepthStep) { EXPECT_EQ(measured_count(wall_with_a_hole(1, 0.1F)), 440); }

TEST(DepthMap, IsTheSameOnAnyNumberOfThreads) {
  PointCloud cloud = block_over_floor();
  cloud.normals.assign(cloud.points.size(), Vector3f(0, 0.6F, -0.8F));
  const SensorView view = *sensor_view(cloud);
  const DepthMap one = depth_map(view, 0.004);
  for (const int threads : {2, 3, 7}) {
    const DepthMap many = depth_map(view, 0.004, {.threads = threads});
    for (std::size_t i = 0; i < one.pixels.size(); ++i) {
      ASSERT_EQ(many.pixels[i].position, one.pixels[i].position) << i;
      ASSERT_EQ(many.pixels[i].normal, one.pixels[i].normal) << i;
    }
  }
}

TEST(DepthMap, HasPixelsOfTheWantedSize) {
  const SensorView view = *sensor_view(block_over_floor());
  const DepthMap map = depth_map(view, 0.004);
  EXPECT_NEAR(map.pixel_size, 0.004, 1e-6);
  EXPECT_NEAR(view.median_depth / map.focal, 0.004, 1e-6);
}

TEST(DepthMap, OfPointsFarApartStaysSmall) {
  for (const float reach : {1e3F, 1e30F}) {
    const SensorView view = *sensor_view(testing::scattered(
        {{0, 0, 1e-3F}, {2e-3F, 0, 1e-3F}, {0, 2e-3F, 1e-3F}, {reach, 0, reach}, {0, reach, reach}, {0, 0, reach}}));
    const DepthMap map = depth_map(view, 0.001);
    EXPECT_LE(map.pixels.size(), 4'500'000u) << reach;
    EXPECT_EQ(map.pixels.size(), static_cast<std::size_t>(map.width) * map.height);
  }
}

TEST(DepthMap, KeepsGivenNormalsTurnedToTheSensorAndDropsSpoiltOnes) {
  PointCloud cloud = testing::scattered({{-0.1F, 0, 1}, {0, 0, 1}, {0.1F, 0, 1}});
  cloud.normals = {{0, 0, -1}, {0, 0, 2}, {kNan, 0, 1}};
  const SensorView view = *sensor_view(cloud);
  const DepthMap map = depth_map(view, 0.05);
  const auto normal_at = [&](int i) { return map.pixels[map.pixel_of(view.points[i])].normal; };
  EXPECT_TRUE(normal_at(0).isApprox(Vector3f(0, 0, -1), 1e-5F));
  EXPECT_TRUE(normal_at(1).isApprox(Vector3f(0, 0, -1), 1e-5F));
  EXPECT_EQ(normal_at(2), Vector3f::Zero());
}

TEST(DepthMap, PixelOfIsMinusOneOutside) {
  const DepthMap map = depth_map(*sensor_view(block_over_floor()), 0.004);
  EXPECT_EQ(map.pixel_of({10, 0, 0.5F}), -1);
  EXPECT_EQ(map.pixel_of({-10, 0, 0.5F}), -1);
  EXPECT_EQ(map.pixel_of({0, 10, 0.5F}), -1);
  EXPECT_EQ(map.pixel_of({kNan, 0, 0.5F}), -1);
}

}  // namespace
}  // namespace binpose

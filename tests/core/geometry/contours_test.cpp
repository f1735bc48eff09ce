#include "core/geometry/contours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/normals.h"
#include "tests/scenes/random.h"
#include "tests/support/ray_cast.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

constexpr double kPixel = 0.002;
constexpr float kStep = 0.004F;
constexpr float kHalf = 0.04F;  // of the block's top

/// A block of 80 x 80 mm under the sensor, its top 0.45 m away; view and scene axes are the same.
DepthMap block(std::optional<double> floor_depth, Unmeasured unmeasured, int threads = 1) {
  Pose T_scene_block = Pose::Identity();
  T_scene_block.translation().z() = 0.46;
  const testing::PlacedMesh bodies[] = {{testing::box({2 * kHalf, 2 * kHalf, 0.02F}), T_scene_block}};
  testing::PinholeSensor sensor;
  sensor.width = 150;
  sensor.height = 114;
  sensor.focal = 1.25 * 0.45 / kPixel;  // more than a point per pixel
  sensor.floor_depth = floor_depth;
  DepthMap map = depth_map(*sensor_view(testing::render(bodies, sensor)), kPixel);
  estimate_normals(map, 1, {.threads = threads});
  find_contours(map, kStep, unmeasured, {.threads = threads});
  return map;
}

void expect_rim_of_the_top(const DepthMap& map) {
  for (const ContourPoint& c : map.contours) {
    const float x = std::abs(c.position.x()), y = std::abs(c.position.y());
    EXPECT_NEAR(c.position.z(), 0.45F, 1e-3F) << "the floor does not end at the block";
    EXPECT_NEAR(std::max(x, y), kHalf, 2.5 * kPixel);
    EXPECT_TRUE(c.normal.isApprox(Vector3f(0, 0, -1), 0.02F));
    EXPECT_NEAR(c.outward.norm(), 1, 1e-5F);
    // Outwards over the nearer side; at the corners over both.
    if (kHalf - std::min(x, y) > 3 * kPixel) {
      const Vector3f away = x > y ? Vector3f(c.position.x() / x, 0, 0) : Vector3f(0, c.position.y() / y, 0);
      EXPECT_GT(c.outward.dot(away), 0.9F) << c.position.transpose();
    }
  }
  // One pixel wide, all the way round.
  EXPECT_NEAR(static_cast<double>(map.contours.size()), 8 * kHalf / kPixel, 0.15 * 8 * kHalf / kPixel);
}

TEST(Contours, OfABlockOnAFloorAreTheRimOfItsTop) { expect_rim_of_the_top(block(0.47, Unmeasured::kUnknown)); }

TEST(Contours, AgainstNothingAreFoundInARenderingOnly) {
  expect_rim_of_the_top(block(std::nullopt, Unmeasured::kFar));
  EXPECT_TRUE(block(std::nullopt, Unmeasured::kUnknown).contours.empty());
}

TEST(Contours, AreNotWhereTheStepIsTooLow) { EXPECT_TRUE(block(0.453, Unmeasured::kUnknown).contours.empty()); }

TEST(Contours, AreFoundByTheirPixel) {
  const DepthMap map = block(0.47, Unmeasured::kUnknown);
  std::size_t count = 0;
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    if (map.contour_at[i] < 0) continue;
    ++count;
    EXPECT_EQ(map.contours[map.contour_at[i]].position, map.pixels[i].position);
  }
  EXPECT_EQ(count, map.contours.size());
}

/// The rule of find_contours() pixel by pixel, without its short cut.
std::vector<ContourPoint> slow_contours(const DepthMap& map, float step, Unmeasured unmeasured) {
  const auto ends = [&](int u, int v, int du, int dv) {
    const int from = v * map.width + u;
    for (int k = 1; k <= 5; ++k) {
      const int column = u + k * du, row = v + k * dv;
      if (column < 0 || row < 0 || column >= map.width || row >= map.height) break;
      const int to = row * map.width + column;
      if (!map.measured(to)) continue;
      const Vector3f way = map.pixels[to].position - map.pixels[from].position;
      return map.pixels[from].normal.dot(way) < -step && way.z() > 0;
    }
    return unmeasured == Unmeasured::kFar;
  };
  std::vector<ContourPoint> contours;
  for (int v = 0; v < map.height; ++v) {
    for (int u = 0; u < map.width; ++u) {
      if (!map.has_normal(v * map.width + u)) continue;
      Vector3f outward = Vector3f::Zero();
      for (int du = -1; du <= 1; ++du) {
        for (int dv = -1; dv <= 1; ++dv) {
          const bool is_direction = du != 0 || dv != 0;
          if (is_direction && ends(u, v, du, dv)) {
            outward += Vector3f(static_cast<float>(du), static_cast<float>(dv), 0).normalized();
          }
        }
      }
      if (outward.squaredNorm() < 0.5F) continue;
      const int i = v * map.width + u;
      contours.push_back({map.pixels[i].position, map.pixels[i].normal, outward.normalized()});
    }
  }
  return contours;
}

TEST(Contours, AreThoseOfTheRuleAppliedToEachPixelOfARaggedScan) {
  for (const Unmeasured unmeasured : {Unmeasured::kUnknown, Unmeasured::kFar}) {
    DepthMap map = block(0.47, unmeasured);
    scenes::Random random(5);
    for (int k = 0; k < 4000; ++k) {  // holes, and points out of place by about the step
      const auto i = static_cast<std::size_t>(random.uniform(0, static_cast<double>(map.pixels.size()) - 1));
      map.pixels[i].position.z() =
          k % 2 == 0 ? 0 : map.pixels[i].position.z() + static_cast<float>(random.uniform(-2, 2)) * kStep;
      if (k % 2 == 0) map.pixels[i].normal.setZero();
    }
    find_contours(map, kStep, unmeasured);
    const std::vector<ContourPoint> slow = slow_contours(map, kStep, unmeasured);
    ASSERT_EQ(map.contours.size(), slow.size());
    EXPECT_GT(slow.size(), 1000);
    for (std::size_t i = 0; i < slow.size(); ++i) {
      EXPECT_EQ(map.contours[i].position, slow[i].position);
      EXPECT_TRUE(map.contours[i].outward.isApprox(slow[i].outward, 1e-4F));
    }
  }
}

TEST(Contours, AreTheSameOnAnyNumberOfThreads) {
  const DepthMap one = block(0.47, Unmeasured::kUnknown, 1);
  for (const int threads : {2, 4}) EXPECT_EQ(block(0.47, Unmeasured::kUnknown, threads).contour_at, one.contour_at);
}

}  // namespace
}  // namespace binpose

#include "core/geometry/sensor_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/support/ray_cast.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;
using ::testing::HasSubstr;

constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();

PointCloud floor_scan() {
  testing::PinholeSensor sensor;
  sensor.width = 160;
  sensor.height = 120;
  sensor.focal = 300;
  return testing::render({}, sensor);
}

TEST(SensorView, MapsBackOntoTheCloud) {
  PointCloud cloud = floor_scan();
  cloud.sensor_position = Eigen::Vector3d(0.05, -0.02, 0.01);
  const absl::StatusOr<SensorView> view = sensor_view(cloud);
  ASSERT_TRUE(view.ok());
  ASSERT_EQ(view->points.size(), cloud.points.size());
  EXPECT_TRUE((view->T_scene_view * Eigen::Vector3d::Zero()).isApprox(cloud.sensor_position));
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d back = view->T_scene_view * view->points[i].cast<double>();
    ASSERT_LT((back - cloud.points[i].cast<double>()).norm(), 1e-6);
  }
}

TEST(SensorView, MeasuresTheSpacingOfAGrid) {
  testing::PinholeSensor sensor;
  sensor.focal = 300;
  const absl::StatusOr<SensorView> view = sensor_view(testing::render({}, sensor));
  ASSERT_TRUE(view.ok());
  EXPECT_NEAR(view->median_depth, 0.5, 1e-4);
  EXPECT_NEAR(view->spacing, 0.5 / 300, 0.1 * 0.5 / 300);
}

TEST(SensorView, LeavesOutWhatWasNotMeasuredOrLiesBehindTheSensor) {
  const absl::StatusOr<SensorView> view = sensor_view(testing::scattered(
      {{0, 0, 0.5F}, {kMissing, 0, 0.5F}, {0, 0, INFINITY}, {0, 0, -0.5F}, {0.01F, 0, 0.5F}, {0, 0.01F, 0.6F}}));
  ASSERT_TRUE(view.ok());
  EXPECT_EQ(view->points.size(), 3u);
  EXPECT_EQ(view->share_behind, 0.25);
}

struct RefusedCloud {
  const char* what;
  PointCloud cloud;
  const char* says;
};

TEST(SensorView, RefusesCloudsThatContradictThemselvesOrHoldNothing) {
  PointCloud wrong_size = testing::scattered({{0, 0, 1}, {0, 0, 2}});
  wrong_size.height = 2;
  PointCloud huge_size = testing::scattered({{0, 0, 1}});
  huge_size.width = huge_size.height = 0xFFFFFFFF;
  PointCloud lost_sensor = testing::scattered({{0, 0, 1}});
  lost_sensor.sensor_position.x() = kMissing;
  PointCloud few_normals = testing::scattered({{0, 0, 1}, {0, 0, 2}});
  few_normals.normals = {{0, 0, -1}};
  const RefusedCloud cases[] = {
      {"size", wrong_size, "2 points; width x height is 2 x 2 = 4"},
      {"huge size", huge_size, "1 points; width x height is"},
      {"empty", testing::scattered({}), "0 points"},
      {"no measurement", testing::scattered({{kMissing, kMissing, kMissing}, {INFINITY, 0, 1}}),
       "no measurement among its 2 points"},
      {"all in the sensor", testing::scattered({{0, 0, 0}, {0, 0, 0}}), "no measurement among its 2 points"},
      {"sensor position", lost_sensor, "sensor_position"},
      {"normals", few_normals, "1 normals for 2 points"},
  };
  for (const RefusedCloud& refused : cases) {
    const absl::StatusOr<SensorView> view = sensor_view(refused.cloud);
    ASSERT_EQ(view.status().code(), absl::StatusCode::kInvalidArgument) << refused.what;
    EXPECT_THAT(std::string(view.status().message()), HasSubstr(refused.says)) << refused.what;
  }
}

TEST(SensorView, KeepsItsPointsInTheirOrderOnAnyNumberOfThreads) {
  PointCloud cloud = floor_scan();
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (i % 7 < 3) cloud.points[i].x() = kMissing;
    cloud.normals.emplace_back(Vector3f(static_cast<float>(i), 0, 0));
  }
  const SensorView one = *sensor_view(cloud);
  EXPECT_LT(one.points.size(), 0.6 * static_cast<double>(cloud.points.size()));
  EXPECT_TRUE(std::is_sorted(one.normals.begin(), one.normals.end(),
                             [](const Vector3f& a, const Vector3f& b) { return a.norm() < b.norm(); }));
  for (const int threads : {2, 5}) {
    const SensorView many = *sensor_view(cloud, {.threads = threads});
    EXPECT_EQ(many.points, one.points);
    EXPECT_EQ(many.normals, one.normals);
    EXPECT_EQ(many.spacing, one.spacing);
    EXPECT_EQ(many.median_depth, one.median_depth);
    EXPECT_EQ(many.window.low_x, one.window.low_x);
    EXPECT_EQ(many.window.high_y, one.window.high_y);
  }
}

}  // namespace
}  // namespace binpose

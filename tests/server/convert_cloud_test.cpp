#include "server/convert_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "server/decode_time.h"

namespace binpose::server {
namespace {

using ::testing::HasSubstr;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class Value>
std::string pack(std::initializer_list<Value> values) {
  return {reinterpret_cast<const char*>(values.begin()), values.size() * sizeof(Value)};
}

v1::PointCloud two_points(v1::LengthUnit unit) {
  v1::PointCloud cloud;
  cloud.set_unit(unit);
  cloud.mutable_points()->set_width(2);
  cloud.mutable_points()->set_height(1);
  cloud.mutable_points()->set_xyz(pack({1.F, 2.F, 3.F, kNaN, 0.F, 0.F}));
  return cloud;
}

TEST(ToCloud, TakesPackedPointsInEitherUnit) {
  EXPECT_EQ(to_cloud(two_points(v1::LENGTH_UNIT_METRE))->points[0], Eigen::Vector3f(1, 2, 3));
  const auto cloud = to_cloud(two_points(v1::LENGTH_UNIT_MILLIMETRE));
  ASSERT_TRUE(cloud.ok());
  EXPECT_EQ(cloud->width, 2);
  EXPECT_EQ(cloud->height, 1);
  EXPECT_TRUE(cloud->points[0].isApprox(Eigen::Vector3f(0.001F, 0.002F, 0.003F)));
  EXPECT_TRUE(cloud->normals.empty());
  EXPECT_FALSE(cloud->intrinsics.has_value());
}

TEST(ToCloud, APointWithAnyCoordinateNotFiniteIsNoMeasurement) {
  for (const float odd : {kNaN, kInfinity, -kInfinity}) {
    v1::PointCloud message = two_points(v1::LENGTH_UNIT_METRE);
    message.mutable_points()->set_xyz(pack({1.F, odd, 3.F, 4.F, 5.F, 6.F}));
    const auto cloud = to_cloud(message);
    ASSERT_TRUE(cloud.ok());
    EXPECT_TRUE(cloud->points[0].array().isNaN().all());
    EXPECT_EQ(cloud->points[1], Eigen::Vector3f(4, 5, 6));
  }
}

TEST(ToCloud, NormalsGetUnitLengthAndNoUnit) {
  v1::PointCloud message = two_points(v1::LENGTH_UNIT_MILLIMETRE);
  message.mutable_points()->set_normals(pack({0.F, 0.F, -0.99F, kNaN, kNaN, kNaN}));
  const auto cloud = to_cloud(message);
  ASSERT_TRUE(cloud.ok());
  EXPECT_EQ(cloud->normals[0], Eigen::Vector3f(0, 0, -1));
}

TEST(ToCloud, ProjectsADepthImageThroughItsCamera) {
  v1::PointCloud message;
  message.set_unit(v1::LENGTH_UNIT_MILLIMETRE);
  v1::DepthImage& depth = *message.mutable_depth();
  depth.set_width(3);
  depth.set_height(1);
  depth.set_depth_scale(0.1);
  depth.mutable_intrinsics()->set_fx(2);
  depth.mutable_intrinsics()->set_fy(4);
  depth.mutable_intrinsics()->set_cx(1);
  depth.mutable_intrinsics()->set_cy(-1);
  depth.set_uint16(pack<std::uint16_t>({0, 10'000, 20'000}));
  auto cloud = to_cloud(message);
  ASSERT_TRUE(cloud.ok());
  EXPECT_TRUE(cloud->points[0].array().isNaN().all());
  EXPECT_TRUE(cloud->points[1].isApprox(Eigen::Vector3f(0, 0.25, 1)));
  EXPECT_TRUE(cloud->points[2].isApprox(Eigen::Vector3f(1, 0.5, 2)));
  EXPECT_EQ(cloud->intrinsics->fy, 4);
  depth.set_float32(pack({-1.F, kInfinity, 10'000.F}));
  cloud = to_cloud(message);
  ASSERT_TRUE(cloud.ok());
  EXPECT_TRUE(cloud->points[0].array().isNaN().all());
  EXPECT_TRUE(cloud->points[1].array().isNaN().all());
  EXPECT_TRUE(cloud->points[2].isApprox(Eigen::Vector3f(0.5, 0.25, 1)));
}

TEST(ToCloud, TheSensorPositionIsInTheCloudsUnit) {
  v1::PointCloud message = two_points(v1::LENGTH_UNIT_MILLIMETRE);
  EXPECT_EQ(to_cloud(message)->sensor_position, Eigen::Vector3d::Zero());
  message.mutable_sensor_position()->set_z(-500);
  EXPECT_TRUE(to_cloud(message)->sensor_position.isApprox(Eigen::Vector3d(0, 0, -0.5)));
}

TEST(DecodeInTime, EndsWhatTakesLongerThanTheLimitAndNamesIt) {
  const auto decode = [](const RunControl& control) -> absl::StatusOr<int> {
    while (!control.interrupted()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return control.status();
  };
  const auto endless = decode_in_time("cloud", {}, decode, std::chrono::seconds(1));
  EXPECT_EQ(endless.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(endless.status().message()), HasSubstr("cloud takes more than 1 s to read"));
  const RunControl hurried = {.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(5)};
  EXPECT_EQ(decode_in_time("cloud", hurried, decode).status().code(), absl::StatusCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace binpose::server

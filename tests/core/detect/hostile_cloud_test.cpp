#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/detect/detect.h"
#include "tests/scenes/random.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// Detection on clouds that no sensor would send: an error that speaks, or an empty answer.
class HostileCloud : public ::testing::Test {
 protected:
  absl::StatusOr<DetectResult> search(const PointCloud& cloud) const {
    const Model* models[] = {&model_};
    return detect(cloud, models, {}, {});
  }
  void expect_refused(const PointCloud& cloud) const {
    const absl::StatusOr<DetectResult> result = search(cloud);
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_FALSE(result.status().message().empty());
  }
  void expect_nothing_found(const PointCloud& cloud) const {
    const absl::StatusOr<DetectResult> result = search(cloud);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_TRUE(result->hypotheses.empty());
  }
  static PointCloud of(int count, const std::function<Vector3f(int)>& point) {
    PointCloud cloud;
    for (int i = 0; i < count; ++i) cloud.points.push_back(point(i));
    cloud.width = static_cast<std::uint32_t>(count);
    cloud.height = 1;
    return cloud;
  }
  static PointCloud scan() {
    const testing::PlacedMesh bodies[] = {{testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43})}};
    return testing::render(bodies, {});
  }

  const Model model_ = testing::quick_model(testing::l_block());
};

TEST_F(HostileCloud, OfNoPointsOrNoMeasurementIsRefused) {
  expect_refused({});
  expect_refused(of(1000, [](int) { return Vector3f(kNan, kNan, kNan); }));
  expect_refused(of(1000, [](int i) { return Vector3f(0, i % 2 ? kInf : -kInf, 1); }));
  expect_refused(of(1000, [](int) { return Vector3f(0, 0, 0); }));
}

TEST_F(HostileCloud, ThatContradictsItselfIsRefused) {
  PointCloud cloud = scan();
  cloud.width += 1;
  expect_refused(cloud);
  cloud = scan();
  cloud.width = cloud.height = 1U << 16;  // the product has no 32 bits
  expect_refused(cloud);
  cloud = scan();
  cloud.normals.resize(7);
  expect_refused(cloud);
}

TEST_F(HostileCloud, WithASensorNowhereIsRefused) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    PointCloud cloud = scan();
    cloud.sensor_position.y() = bad;
    expect_refused(cloud);
  }
}

TEST_F(HostileCloud, WithTheSensorFarAwayOrInsideFindsNothingOrRefuses) {
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(0, 0, 0.43), Eigen::Vector3d(0, 0, 0.5), Eigen::Vector3d(0.3, 0, 0.499),
        Eigen::Vector3d(0, 0, 1e6), Eigen::Vector3d(1e30, 0, 0), Eigen::Vector3d(1e300, 0, 0)}) {
    PointCloud cloud = scan();
    cloud.sensor_position = at;
    const absl::StatusOr<DetectResult> result = search(cloud);
    if (result.ok()) continue;
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << at.transpose();
  }
}

TEST_F(HostileCloud, AroundItsSensorIsAnsweredWithAWarningThatNamesTheSensor) {
  PointCloud cloud = scan();
  ASSERT_EQ(search(cloud)->hypotheses.size(), 1U);
  EXPECT_TRUE(search(cloud)->warnings.empty());
  cloud.sensor_position = Eigen::Vector3d(0.05, 0, 0.49);  // beside the part, next to the ground
  const absl::StatusOr<DetectResult> result = search(cloud);
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_FALSE(result->warnings.empty());
  EXPECT_THAT(result->warnings[0], ::testing::HasSubstr("beside or behind sensor_position (0.05, 0, 0.49) m"));
}

TEST_F(HostileCloud, OfOnePointOrOneLineOrOnePlaceHoldsNothing) {
  expect_nothing_found(of(1, [](int) { return Vector3f(0, 0, 0.5F); }));
  expect_nothing_found(of(2, [](int i) { return Vector3f(0.1F * static_cast<float>(i), 0, 0.5F); }));
  expect_nothing_found(of(5000, [](int i) { return Vector3f(1e-4F * static_cast<float>(i), 0, 0.5F); }));
  expect_nothing_found(of(5000, [](int i) { return Vector3f(0, 0, 0.5F + 1e-4F * static_cast<float>(i)); }));
  expect_nothing_found(of(5000, [](int) { return Vector3f(0.1F, 0.2F, 0.5F); }));
}

TEST_F(HostileCloud, OfHugeOrTinyCoordinatesHoldsNothing) {
  scenes::Random random(1);
  for (const float scale : {1e-30F, 1e-6F, 1e-3F, 1e3F, 1e9F, 1e19F, 1e30F, 3e38F}) {
    PointCloud cloud = scan();
    for (Vector3f& p : cloud.points) p *= scale;
    const absl::StatusOr<DetectResult> result = search(cloud);
    EXPECT_TRUE(!result.ok() || result->hypotheses.empty()) << scale;
    // A few wild points among good ones must not spoil more than the resolution.
    PointCloud mixed = scan();
    for (int i = 0; i < 20; ++i) {
      mixed.points[random.next() % mixed.points.size()] =
          scale * (random.rotation() * Eigen::Vector3d::UnitX()).cast<float>();
    }
    EXPECT_TRUE(search(mixed).ok()) << scale;
  }
}

TEST_F(HostileCloud, OfNoiseHoldsNothing) {
  scenes::Random random(2);
  expect_nothing_found(of(20'000, [&](int) {
    return Vector3f(static_cast<float>(random.uniform(-0.1, 0.1)), static_cast<float>(random.uniform(-0.1, 0.1)),
                    static_cast<float>(random.uniform(0.3, 0.5)));
  }));
}

TEST_F(HostileCloud, WithSpoiltNormalsIsSearchedWithoutThem) {
  PointCloud cloud = scan();
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vector3f bad[] = {{kNan, 0, 1}, {0, 0, 0}, {1e30F, 1e30F, 1e30F}, {kInf, 0, 0}};
    cloud.normals.push_back(bad[i % 4]);
  }
  EXPECT_TRUE(search(cloud).ok());
}

TEST_F(HostileCloud, NearerThanThePartIsLargeHoldsNothing) {
  // Pairs would reach over all of the image.
  PointCloud cloud = scan();
  for (Vector3f& p : cloud.points) p *= 0.02F;
  const absl::StatusOr<DetectResult> result = search(cloud);
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result->hypotheses.empty());
}

}  // namespace
}  // namespace binpose

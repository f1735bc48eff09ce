#include "core/detect/uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/detect/judge.h"
#include "core/detect/refine.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

struct UncertainScan : testing::PartScan {
  using PartScan::PartScan;

  Uncertainty uncertainty() const {
    return uncertainty_of(map, model, testing::in_view(map, T_scene_model), final_verification(map, model), 1e-4);
  }
};

TEST(Uncertainty, ABlockOfWhichThreeSidesShowIsHeldInAllDirections) {
  const UncertainScan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  const Uncertainty found = scan.uncertainty();
  EXPECT_TRUE(found.free_directions.empty());
  EXPECT_TRUE(found.covariance.isApprox(found.covariance.transpose(), 1e-9));
  for (int i = 0; i < 6; ++i) EXPECT_GT(found.covariance(i, i), 0);
  EXPECT_LT(std::sqrt(found.covariance.diagonal().head<3>().maxCoeff()), 1e-4) << "below the error of one point";
}

TEST(Uncertainty, ATurnAboutAnAxisOfRevolutionIsFree) {
  const UncertainScan scan(testing::stepped_shaft(), testing::pose(80, Vector3d::UnitX(), {0, 0, 0.45}));
  const Uncertainty found = scan.uncertainty();
  ASSERT_EQ(found.free_directions.size(), 1u);
  const Vector3d turn = found.free_directions[0].tail<3>();
  const Vector3d axis = testing::in_view(scan.map, scan.T_scene_model).linear().col(2).cast<double>();
  EXPECT_GT(std::abs(turn.normalized().dot(axis)), std::cos(5 * kDegree));
}

TEST(Uncertainty, APlateIsHeldByItsRimAndSlidesWithoutIt) {
  UncertainScan scan(testing::hexagon(), testing::pose(10, Vector3d::UnitZ(), {0, 0, 0.494}));
  EXPECT_TRUE(scan.uncertainty().free_directions.empty());
  scan.map.contours.clear();
  scan.map.contour_at.assign(scan.map.pixels.size(), -1);
  const Uncertainty found = scan.uncertainty();
  EXPECT_EQ(found.free_directions.size(), 3u) << "two ways to slide, one to turn";
  for (const Twist& motion : found.free_directions) {
    EXPECT_LT(std::abs(motion[2]), 0.2 * motion.head<3>().norm() + 1e-3) << "none towards the sensor";
  }
}

TEST(Uncertainty, IsAboutWhatRefinementErrsByOverManyScans) {
  constexpr int kScans = 40;
  constexpr double kNoise = 3e-4;
  const UncertainScan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  testing::PinholeSensor sensor = testing::bin_sensor();
  sensor.noise = kNoise;
  const RefineOptions options = {.first_gate = static_cast<float>(0.03 * scan.model.diameter),
                                 .last_gate = static_cast<float>(0.03 * scan.model.diameter),
                                 .most_points = 2000};
  std::vector<Twist> errors;
  Matrix6d told = Matrix6d::Zero();
  for (int i = 0; i < kScans; ++i) {
    sensor.seed = static_cast<std::uint64_t>(i) + 1;
    const DepthMap map = testing::scan_map(scan.bodies, sensor, scan.model.diameter);
    const Eigen::Isometry3f truth = testing::in_view(map, scan.T_scene_model);
    const Eigen::Isometry3f found = refine(map, scan.model, truth, options);
    const Eigen::AngleAxisf turn(Eigen::Matrix3f(found.linear() * truth.linear().transpose()));
    const Eigen::Vector3f centre = scan.model.centre.cast<float>();
    Twist error;
    error << (found * centre - truth * centre).cast<double>(), (turn.angle() * turn.axis()).cast<double>();
    errors.push_back(error);
    told += uncertainty_of(map, scan.model, found, final_verification(map, scan.model), kNoise).covariance / kScans;
  }
  Twist mean = Twist::Zero();
  for (const Twist& error : errors) mean += error / kScans;
  Matrix6d seen = Matrix6d::Zero();
  for (const Twist& error : errors) seen += (error - mean) * (error - mean).transpose() / (kScans - 1);
  for (int k = 0; k < 6; ++k) {
    const double ratio = std::sqrt(told(k, k) / seen(k, k));
    EXPECT_GT(ratio, 0.4) << k;
    EXPECT_LT(ratio, 2.5) << k;
  }
}

TEST(Uncertainty, AnErrorOfTwiceTheSizeHasFourTimesTheCovariance) {
  const UncertainScan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  const auto with = [&](double residual) {
    return uncertainty_of(scan.map, scan.model, testing::in_view(scan.map, scan.T_scene_model),
                          final_verification(scan.map, scan.model), residual)
        .covariance;
  };
  EXPECT_TRUE(with(0.02).isApprox(4 * with(0.01), 1e-9));
}

}  // namespace
}  // namespace binpose

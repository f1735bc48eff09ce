#include "core/detect/uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/detect/refine.h"
#include "core/detect/search.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

struct Scan : testing::PartScan {
  using PartScan::PartScan;

  Uncertainty uncertainty() const {
    return uncertainty_of(map, model, testing::in_view(map, T_scene_model), final_verification(map, model), 1e-4);
  }
};

TEST(Uncertainty, ABlockOfWhichThreeSidesShowIsHeldInAllDirections) {
  const Scan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  const Uncertainty found = scan.uncertainty();
  EXPECT_TRUE(found.free_directions.empty());
  EXPECT_TRUE(found.covariance.isApprox(found.covariance.transpose(), 1e-9));
  for (int i = 0; i < 6; ++i) EXPECT_GT(found.covariance(i, i), 0);
  EXPECT_LT(std::sqrt(found.covariance.diagonal().head<3>().maxCoeff()), 1e-4) << "below the error of one point";
}

TEST(Uncertainty, ATurnAboutAnAxisOfRevolutionIsFree) {
  const Scan scan(testing::stepped_shaft(), testing::pose(80, Vector3d::UnitX(), {0, 0, 0.45}));
  const Uncertainty found = scan.uncertainty();
  ASSERT_EQ(found.free_directions.size(), 1u);
  const Vector3d turn = found.free_directions[0].tail<3>();
  const Vector3d axis = testing::in_view(scan.map, scan.T_scene_model).linear().col(2).cast<double>();
  EXPECT_GT(std::abs(turn.normalized().dot(axis)), std::cos(5 * kDegree));
}

TEST(Uncertainty, APlateIsHeldByItsRimAndSlidesWithoutIt) {
  Scan scan(testing::hexagon(), testing::pose(10, Vector3d::UnitZ(), {0, 0, 0.494}));
  EXPECT_TRUE(scan.uncertainty().free_directions.empty());
  scan.map.contours.clear();
  scan.map.contour_at.assign(scan.map.points.size(), -1);
  const Uncertainty found = scan.uncertainty();
  EXPECT_EQ(found.free_directions.size(), 3u) << "two ways to slide, one to turn";
  for (const Twist& motion : found.free_directions) {
    EXPECT_LT(std::abs(motion[2]), 0.2 * motion.head<3>().norm() + 1e-3) << "none towards the sensor";
  }
}

TEST(Uncertainty, AnErrorOfTwiceTheSizeHasFourTimesTheCovariance) {
  const Scan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  const auto with = [&](double residual) {
    return uncertainty_of(scan.map, scan.model, testing::in_view(scan.map, scan.T_scene_model),
                          final_verification(scan.map, scan.model), residual)
        .covariance;
  };
  EXPECT_TRUE(with(0.02).isApprox(4 * with(0.01), 1e-9));
}

}  // namespace
}  // namespace binpose

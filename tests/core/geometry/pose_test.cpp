#include "core/geometry/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/geometry/view_sphere.h"

namespace binpose {
namespace {

TEST(TurnOfZTo, LeadsZToEachDirectionByTheAngleBetweenThem) {
  for (const Eigen::Vector3f& direction : view_directions(300)) {
    const Eigen::Vector3d d = direction.cast<double>().normalized();
    const Eigen::Quaterniond turn = turn_of_z_to<double>(d);
    EXPECT_LT((turn * Eigen::Vector3d::UnitZ() - d).norm(), 1e-12);
    EXPECT_NEAR(turn.angularDistance(Eigen::Quaterniond::Identity()), std::acos(d.z()), 1e-6);
  }
}

TEST(TurnOfZTo, IsARotationNextToTheOppositeOfZ) {
  for (const float tilt : {0.0F, 1e-6F, 1e-4F, 2e-3F, 0.1F}) {
    const Eigen::Vector3f direction(std::sin(tilt), 0, -std::cos(tilt));
    const Eigen::Quaternionf turn = turn_of_z_to<float>(direction);
    EXPECT_NEAR(turn.norm(), 1, 1e-3) << tilt;
    EXPECT_LT((turn.normalized() * Eigen::Vector3f::UnitZ() - direction).norm(), 0.01F) << tilt;
  }
}

TEST(RotationDistance, IsTheAngleOfTheTurnBetween) {
  const Pose a(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  EXPECT_NEAR(rotation_distance(a, a * Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized())), 1.2, 1e-12);
}

TEST(SeenFrom, MovesThePointOfWhichAMotionIsTold) {
  const Eigen::Vector3d shift(0.1, -0.2, 0.3), translation(0.01, 0.02, 0.03), rotation(0.5, 0.6, -0.7);
  Twist motion;
  motion << translation, rotation;
  const Twist moved = seen_from(shift) * motion;
  EXPECT_LT((moved.head<3>() - (translation + rotation.cross(shift))).norm(), 1e-12);
  EXPECT_EQ(moved.tail<3>(), rotation);
}

}  // namespace
}  // namespace binpose

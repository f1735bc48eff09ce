#include "tests/scenes/penetration.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/scenes/box_mesh.h"

namespace binpose::scenes {
namespace {

/// 20 mm wide, centred.
Mesh small_cube() { return box_mesh({Eigen::Vector3d::Constant(-0.01), Eigen::Vector3d::Constant(0.01)}); }

Pose at(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

TEST(Penetration, OfFacesPressedIntoEachOtherIsTheirOverlap) {
  EXPECT_NEAR(deepest_penetration(small_cube(), {at(0, 0, 0), at(0.0197, 0.003, 0.002)}), 0.0003, 1e-6);
}

TEST(Penetration, OfACornerInAFaceIsHowFarItPokesIn) {
  Pose corner_up = Pose::Identity();  // the diagonal of the cube along z
  corner_up.linear() = turn_of_z_to<double>(Eigen::Vector3d(1, 1, 1).normalized()).inverse().matrix();
  const double reach = 0.01 * std::numbers::sqrt3;
  corner_up.translation().z() = -0.01 - reach + 0.0004;
  EXPECT_NEAR(deepest_penetration(small_cube(), {at(0, 0, 0), corner_up}), 0.0004, 1e-6);
}

TEST(Penetration, OfPartsApartIsNone) {
  EXPECT_EQ(deepest_penetration(small_cube(), {at(0, 0, 0), at(0.0201, 0, 0)}), 0);
}

TEST(Outside, CountsFloorAndWallsButNotWhatLeansOverTheRim) {
  const Bin bin{.length = 0.2, .width = 0.1, .height = 0.03};
  EXPECT_EQ(deepest_outside(small_cube(), {at(0, 0, 0.01)}, bin), 0);
  EXPECT_NEAR(deepest_outside(small_cube(), {at(0, 0, 0.009)}, bin), 0.001, 1e-6);
  EXPECT_NEAR(deepest_outside(small_cube(), {at(0.092, 0, 0.01)}, bin), 0.002, 1e-6);
  EXPECT_NEAR(deepest_outside(small_cube(), {at(0, -0.043, 0.01)}, bin), 0.003, 1e-6);
  EXPECT_EQ(deepest_outside(small_cube(), {at(0.092, 0, 0.05)}, bin), 0);
}

}  // namespace
}  // namespace binpose::scenes

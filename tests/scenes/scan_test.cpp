#include "tests/scenes/scan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scenes/box_mesh.h"

namespace binpose::scenes {
namespace {

constexpr Bin kBin{.length = 0.2, .width = 0.15, .height = 0.04};

/// 40 mm wide, standing on its origin.
Mesh cube() { return box_mesh({Eigen::Vector3d(-0.02, -0.02, 0), Eigen::Vector3d(0.02, 0.02, 0.04)}); }

int measured(const Scan& scan) {
  int count = 0;
  for (const auto& point : scan.cloud.points) count += !std::isnan(point.z());
  return count;
}

/// Measured points on the floor of the bin within 6 mm of a place beside the cube, bin frame.
int on_floor_near(const Scan& scan, double x, double y) {
  int count = 0;
  for (const auto& point : scan.cloud.points) {
    if (std::isnan(point.z())) continue;
    const Eigen::Vector3d p = scan.T_scene_bin.inverse() * point.cast<double>();
    count += std::abs(p.z()) < 0.001 && std::hypot(p.x() - x, p.y() - y) < 0.006;
  }
  return count;
}

TEST(Scan, PutsPointsOnTheFloorAtTheSpacingAndNoiseAskedFor) {
  Scanner scanner;
  scanner.noise = 0.0003;
  const Scan scan = scan_bin(cube(), {}, kBin, scanner, Random(3));
  double squares = 0;
  int count = 0;
  for (std::uint32_t v = scan.cloud.height / 3; v < scan.cloud.height * 2 / 3; ++v) {
    for (std::uint32_t u = scan.cloud.width / 3; u < scan.cloud.width * 2 / 3; ++u) {
      const Eigen::Vector3f& point = scan.cloud.points[v * scan.cloud.width + u];
      if (std::isnan(point.z())) continue;
      squares += std::pow((scan.T_scene_bin.inverse() * point.cast<double>()).z(), 2), ++count;
    }
  }
  ASSERT_GT(count, 1000);
  EXPECT_NEAR(std::sqrt(squares / count), 0.0003, 0.00002);
  EXPECT_NEAR(scan.cloud.intrinsics->fx, scanner.distance / scanner.point_spacing, 1e-9);
}

TEST(Scan, LeavesTheShadowOfTheProjectorEmpty) {
  Scanner scanner;
  scanner.flying_share = 0;
  scanner.projector = Eigen::Vector3d(0.4, 0, 0);  // the light falls towards -x, the picture's left
  const Scan lit_from_aside = scan_bin(cube(), {Pose::Identity()}, kBin, scanner, Random(1));
  EXPECT_EQ(on_floor_near(lit_from_aside, -0.031, 0), 0);
  EXPECT_GT(on_floor_near(lit_from_aside, 0.031, 0), 100);
  scanner.projector.setZero();
  const Scan lit_from_camera = scan_bin(cube(), {Pose::Identity()}, kBin, scanner, Random(1));
  EXPECT_GT(on_floor_near(lit_from_camera, -0.031, 0), 100);
}

TEST(Scan, SeesAllOfWhatLiesAloneAndLessOfWhatIsCovered) {
  const Pose on_top(Eigen::Translation3d(0.01, 0, 0.0401));
  const Scan scan = scan_bin(cube(), {Pose::Identity(), on_top}, kBin, Scanner{}, Random(1));
  const Instance& below = scan.instances[0];
  const Instance& above = scan.instances[1];
  EXPECT_LT(below.visible_points, 0.5 * below.alone_points);
  EXPECT_NEAR(above.visible_points, above.alone_points, 0.02 * above.alone_points);
}

TEST(Scan, LosesSurfacesAtGrazingIncidence) {
  Scanner scanner;
  const int all = measured(scan_bin(cube(), {}, kBin, scanner, Random(1)));
  scanner.grazing_from = 0, scanner.grazing_to = 5;  // the floor lies steeper than that to the projector
  EXPECT_LT(measured(scan_bin(cube(), {}, kBin, scanner, Random(1))), all / 100);
}

}  // namespace
}  // namespace binpose::scenes

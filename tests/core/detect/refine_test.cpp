#include "core/detect/refine.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/detect/verify.h"
#include "tests/scenes/random.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

struct Error {
  double degrees, metres;
};

struct RefinedScan : testing::PartScan {
  using PartScan::PartScan;

  RefineOptions options() const {
    RefineOptions options;
    options.first_gate = static_cast<float>(0.08 * model.diameter);
    options.last_gate = static_cast<float>(0.025 * model.diameter);
    return options;
  }
  Pose refined(const Pose& start) const {
    const Eigen::Isometry3f T_view_model = refine(map, model, testing::in_view(map, start), options());
    return map.T_scene_view * Pose(T_view_model.matrix().cast<double>());
  }
  Error error(const Pose& found) const {
    return {rotation_distance(found, T_scene_model) / kDegree,
            (found * model.centre - T_scene_model * model.centre).norm()};
  }
  /// The true pose turned about the part's centre and shifted by a share of the diameter.
  Pose disturbed(double degrees, const Vector3d& axis, const Vector3d& shift) const {
    Pose turn = testing::pose(degrees, axis, model.diameter * shift);
    const Vector3d centre = T_scene_model * model.centre;
    return Eigen::Translation3d(centre) * turn * Eigen::Translation3d(-centre) * T_scene_model;
  }
};

TEST(Refine, ConvergesFromThreeDegreesAndFivePercent) {
  const RefinedScan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  scenes::Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Vector3d axis = random.rotation() * Vector3d::UnitX(), shift = random.rotation() * Vector3d(0.05, 0, 0);
    const Error error = scan.error(scan.refined(scan.disturbed(3, axis, shift)));
    EXPECT_LT(error.degrees, 0.7) << i;
    EXPECT_LT(error.metres, 0.008 * scan.model.diameter) << i;
  }
}

TEST(Refine, StaysAtTheTruth) {
  for (const Pose& pose :
       {testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}), testing::pose(25, {0, 1, 1}, {0.02, 0, 0.45})}) {
    const RefinedScan scan(testing::l_block(), pose);
    const Error error = scan.error(scan.refined(pose));
    EXPECT_LT(error.degrees, 0.4);
    EXPECT_LT(error.metres, 0.005 * scan.model.diameter);
  }
}

TEST(Refine, HoldsAFlatPartByItsRim) {
  // Of a plate on the floor only the top shows: nothing but its rim tells where it lies.
  RefinedScan scan(testing::hexagon(), testing::pose(10, Vector3d::UnitZ(), {0, 0, 0.494}));
  const Pose start = scan.disturbed(0, Vector3d::UnitZ(), {0.04, 0.03, 0});
  EXPECT_LT(scan.error(scan.refined(start)).metres, 0.015 * scan.model.diameter);
  scan.map.contours.clear();
  scan.map.contour_at.assign(scan.map.pixels.size(), -1);
  EXPECT_GT(scan.error(scan.refined(start)).metres, 0.035 * scan.model.diameter) << "without contours it stays away";
}

TEST(Refine, LeavesAPoseAloneWhereNothingIs) {
  const RefinedScan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  for (const Vector3d& at : {Vector3d(5, 0, 0.5), Vector3d(0, 0, -0.5), Vector3d(0, 0, 0.2)}) {
    const Pose nowhere = testing::pose(10, Vector3d::UnitX(), at);
    EXPECT_TRUE(scan.refined(nowhere).isApprox(nowhere, 1e-5)) << at.transpose();
  }
}

/// The slow twin of what draws a pose to contours: one outline point after the other; translations before rotations.
Matrix6d outline_information(const testing::PartScan& scan, const Eigen::Isometry3f& T, float gate) {
  const DepthMap& map = scan.map;
  const Eigen::Vector3f pivot = T * scan.model.centre.cast<float>();
  const int reach = std::max(1, static_cast<int>(gate / map.pixel_size));
  Matrix6d information = Matrix6d::Zero();
  for (const ContourPoint& outline : scan.model.outlines[nearest_viewpoint(scan.model, T)]) {
    const Eigen::Vector3f p = T * outline.position, normal = T.linear() * outline.normal;
    const Eigen::Vector3f outward = T.linear() * outline.outward;
    for (int k = 0; k <= 2 * reach; ++k) {
      const int step = k % 2 == 0 ? k / 2 : -(k + 1) / 2;
      const int pixel = map.pixel_of(p + static_cast<float>(step) * map.pixel_size * outward);
      if (pixel < 0 || map.contour_at[pixel] < 0) continue;
      const ContourPoint& contour = map.contours[map.contour_at[pixel]];
      const Eigen::Vector3f offset = contour.position - p;
      if (contour.outward.dot(outward) <= 0.7F || std::abs(normal.dot(offset)) >= gate) continue;
      const double relative = outward.dot(offset) / gate;
      Twist row;
      row << outward.cast<double>(), (p - pivot).cross(outward).cast<double>();
      if (std::abs(relative) < 1) information += std::pow(1 - relative * relative, 2) * row * row.transpose();
      break;
    }
  }
  return information;
}

TEST(Refine, LooksForContoursOfEightOutlinePointsAtATimeAsALoopDoesOneByOne) {
  const RefinedScan scan(testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43}));
  for (const double off : {0.0, 0.01, 0.03}) {
    const Eigen::Isometry3f T = testing::in_view(scan.map, scan.disturbed(2, Vector3d::UnitX(), {off, off, 0}));
    const float gate = static_cast<float>(0.05 * scan.model.diameter);
    const Matrix6d expected = outline_information(scan, T, gate);
    ASSERT_GT(expected.norm(), 5) << off;
    EXPECT_LT((information_of(scan.map, scan.model, T, gate).outline - expected).norm(), 1e-3 * expected.norm()) << off;
  }
}

TEST(Refine, KeepsARotation) {
  const RefinedScan scan(testing::stepped_shaft(), testing::pose(80, {1, 0.5, 0.2}, {0, 0, 0.45}));
  const Pose found = scan.refined(scan.disturbed(3, Vector3d::UnitX(), {0.03, 0, 0}));
  EXPECT_TRUE(found.linear().isUnitary(1e-4));
  EXPECT_NEAR(found.linear().determinant(), 1, 1e-4);
}

}  // namespace
}  // namespace binpose

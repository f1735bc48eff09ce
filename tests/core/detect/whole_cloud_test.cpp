#include "core/detect/whole_cloud.h"

#include <gtest/gtest.h>

#include <random>

#include "core/params.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

constexpr float kGate = 0.015F;  // diameters
constexpr float kOnSurface = 0.0005F;

/// The block, and a cloud of all its sides.
struct AllSides {
  Model model = testing::quick_model(testing::l_block());
  Pose truth = testing::pose(35, {1, 0.4, -0.2}, {0.03, -0.02, 0.6});
  SensorView view = sensor_view(testing::all_sides(testing::l_block(), truth, 0.003)).value();
  WholeSurface surface{model};
  WholeCloud cloud{view, 0.0005F, surface.reach()};

  Eigen::Isometry3f in_view(const Pose& T_scene_model) const {
    return Eigen::Isometry3f((view.T_scene_view.inverse() * T_scene_model).cast<float>());
  }
  Pose in_scene(const Eigen::Isometry3f& T_view_model) const {
    return view.T_scene_view * Pose(T_view_model.cast<double>());
  }
};

const AllSides& all_sides() {
  static const AllSides sides;
  return sides;
}

/// The truth, moved a little.
Pose beside_truth(double degrees, const Vector3d& shift) {
  const Model& model = all_sides().model;
  return all_sides().truth * Eigen::Translation3d(shift) *
         turn_about<double>(model.centre,
                            Eigen::AngleAxisd(degrees * kDegree, Vector3d(1, -2, 1).normalized()).toRotationMatrix());
}

TEST(WholeCloud, FindsInABoxWhatLookingAtEveryPointFinds) {
  const AllSides& sides = all_sides();
  std::size_t count = 0;
  for (const double degrees : {0.0, 40.0, 170.0}) {
    const Eigen::Isometry3f T = sides.in_view(beside_truth(degrees, {0.01, 0.005, 0.004}));
    const Eigen::Vector3f corner = sides.model.box_min.cast<float>(), middle = sides.model.centre.cast<float>();
    const Eigen::AlignedBox3f box(corner - Eigen::Vector3f::Constant(0.02F), middle);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < sides.cloud.points().size(); ++i) {
      if (box.contains(T.inverse() * sides.cloud.points()[i])) expected.push_back(i);
    }
    EXPECT_EQ(sides.cloud.in_box(box, T), expected);
    count += expected.size();
  }
  EXPECT_GT(count, 40u);
}

TEST(WholeCloud, KeepsOnePointOfEachCell) {
  PointCloud line = testing::scattered({});
  for (int i = 0; i < 1000; ++i) line.points.emplace_back(0.0001F * static_cast<float>(i), 0.0F, 0.5F);
  line.width = 1000;
  const WholeCloud cloud(sensor_view(line).value(), 0.002F, 0.01F);
  EXPECT_GE(cloud.points().size(), 50u);
  EXPECT_LE(cloud.points().size(), 60u);
}

TEST(WholeSurface, FindsTheNearestPointAsLookingAtEveryPointDoes) {
  const AllSides& sides = all_sides();
  std::mt19937 random(3);
  const Vector3d size = sides.model.box_max - sides.model.box_min;
  std::uniform_real_distribution<double> share(-0.1, 1.1);
  int found_count = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d at = Vector3d(share(random), share(random), share(random)).cwiseProduct(size);
    const Eigen::Vector3f p = (sides.model.box_min + at).cast<float>();
    const float distance = sides.surface.reach() * (i % 2 == 0 ? 1.0F : 0.3F);
    float least = distance;
    for (const SurfacePoint& point : sides.model.surface) least = std::min(least, (point.position - p).norm());
    const SurfacePoint* found = sides.surface.nearest(p, distance);
    ASSERT_EQ(found != nullptr, least < distance);
    if (found == nullptr) continue;
    ++found_count;
    EXPECT_NEAR((found->position - p).norm(), least, 1e-6F);
  }
  EXPECT_GT(found_count, 300);
}

TEST(WholeSurface, DrawsAPoseToTheTruthFromHalfItsReach) {
  const AllSides& sides = all_sides();
  const float gate = kGate * static_cast<float>(sides.model.diameter);
  const Vector3d far = 0.5 * sides.surface.reach() * Vector3d(2, -2, 1) / 3;
  for (const Vector3d& shift : {Vector3d(0.002, -0.0025, 0.001), far}) {
    for (const double degrees : {-4.0, 0.5, 3.0}) {
      const Pose start = beside_truth(degrees, shift);
      const Pose found = sides.in_scene(sides.surface.refine(sides.cloud, sides.in_view(start), gate));
      EXPECT_LT((found * sides.model.centre - sides.truth * sides.model.centre).norm(), 1e-4);
      EXPECT_LT(rotation_distance(found, sides.truth), 0.1 * kDegree);
    }
  }
}

TEST(WholeSurface, LeavesAPoseWhereThereIsNothing) {
  const AllSides& sides = all_sides();
  const Eigen::Isometry3f nowhere = sides.in_view(beside_truth(0, {0.5, 0, 0}));
  EXPECT_TRUE(sides.surface.refine(sides.cloud, nowhere, kGate).isApprox(nowhere));
  EXPECT_TRUE(sides.surface.explained(sides.cloud, nowhere, kOnSurface).empty());
}

TEST(WholeSurface, ExplainsNextToAllPointsWhereThePartLiesAndFewerWhenItIsTurned) {
  const AllSides& sides = all_sides();
  const std::size_t all = sides.cloud.points().size();
  EXPECT_GT(sides.surface.explained(sides.cloud, sides.in_view(sides.truth), kOnSurface).size(), 0.98 * all);
  const Pose turned = sides.truth * testing::pose(180, Vector3d::UnitX(), {0, 0.08, 0});  // its long side on itself
  EXPECT_LT(sides.surface.explained(sides.cloud, sides.in_view(turned), kOnSurface).size(), 0.8 * all);
}

}  // namespace
}  // namespace binpose

#include "core/detect/variants.h"

#include <gtest/gtest.h>

#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

/// A part alone.
struct MarkedScan {
  Model model;
  DepthMap map;

  explicit MarkedScan(const Pose& T_scene_model, const Mesh& part = testing::marked_hexagon())
      : model(testing::quick_model(part)), map(testing::scan_map({{{part, T_scene_model}}}, {}, model.diameter)) {}
  VariantChoice choose(const Pose& T) const {
    VerifyOptions options;
    options.tolerance = static_cast<float>(0.012 * model.diameter);
    return choose_variant(map, model, testing::in_view(map, T), options);
  }
};

Pose turned(const Pose& T, double degrees) { return T * testing::pose(degrees, Vector3d::UnitZ(), Vector3d::Zero()); }

// The marked face towards the sensor, which looks along z; then away from it.
const Pose kMarkSeen = testing::pose(175, Vector3d::UnitX(), {0, 0, 0.35});
const Pose kMarkHidden = testing::pose(5, Vector3d::UnitX(), {0, 0, 0.35});

TEST(Variants, TellATurnFromTheTruthByTheMark) {
  const MarkedScan scan(kMarkSeen);
  ASSERT_FALSE(scan.model.similar_poses.empty());
  for (int sixth = 0; sixth < 6; ++sixth) {
    const VariantChoice choice = scan.choose(turned(kMarkSeen, 60 * sixth));
    const Pose chosen(choice.T_view_model.cast<double>());
    const Pose truth(testing::in_view(scan.map, kMarkSeen).cast<double>());
    EXPECT_LT(rotation_distance(chosen, truth), 4 * kDegree) << sixth;
    EXPECT_GT(choice.confidence, 0.95F) << sixth;
    EXPECT_TRUE(choice.rivals.empty()) << sixth;
  }
}

TEST(Variants, AreRivalsWhenTheMarkIsHidden) {
  const MarkedScan scan(kMarkHidden);
  const VariantChoice choice = scan.choose(kMarkHidden);
  EXPECT_GE(choice.rivals.size(), 5u);
  EXPECT_LT(choice.confidence, 0.5F);
}

TEST(Variants, OfAPinnedDiscAreToldByThePinFromAnyTurn) {
  const MarkedScan scan(kMarkSeen, testing::pinned_disc());
  for (const double degrees : {8.0, 100.0, 203.0}) {
    const VariantChoice choice = scan.choose(turned(kMarkSeen, degrees));
    const Pose chosen(choice.T_view_model.cast<double>());
    const Pose truth(testing::in_view(scan.map, kMarkSeen).cast<double>());
    EXPECT_LT(rotation_distance(chosen, truth), 7 * kDegree) << degrees;
    EXPECT_GT(choice.confidence, 0.9F) << degrees;  // the turns beside it are the same pose
    EXPECT_TRUE(choice.rivals.empty()) << degrees;
  }
}

TEST(Variants, OfAPinnedDiscAreAllTheOthersWhenThePinIsHidden) {
  const MarkedScan scan(kMarkHidden, testing::pinned_disc());
  const VariantChoice choice = scan.choose(kMarkHidden);
  EXPECT_GE(choice.rivals.size(), 25u);
  EXPECT_LT(choice.confidence, 0.2F);
}

TEST(Variants, OfAPartWithoutLikesIsThePoseItself) {
  const Pose pose = testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43});
  const Model model = testing::quick_model(testing::l_block());
  const DepthMap map = testing::scan_map({{{testing::l_block(), pose}}}, {}, model.diameter);
  const Eigen::Isometry3f T = testing::in_view(map, pose);
  const VariantChoice choice = choose_variant(map, model, T, {});
  EXPECT_EQ(choice.T_view_model.matrix(), T.matrix());
  EXPECT_EQ(choice.confidence, 1.0F);
  EXPECT_TRUE(choice.rivals.empty());
}

}  // namespace
}  // namespace binpose

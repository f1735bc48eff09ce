#include "core/detect/rivals.h"

#include <gtest/gtest.h>

#include "core/detect/detect.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

/// Half a turn about the middle of the long plain side: that side ends up on itself, the short leg at the other end.
Pose turned(const Pose& T) { return T * testing::pose(180, Vector3d::UnitX(), {0, 0.08, 0}); }

// The block's long plain side towards the sensor, so that nothing of the short leg shows; then its L.
const Pose kPlainSide = testing::pose(-90, Vector3d::UnitY(), {0, -0.04, 0.42});
const Pose kTellingSide = testing::pose(15, Vector3d::UnitX(), {-0.02, -0.04, 0.43});

Rivalry rivalry(const testing::PartScan& scan, const Pose& T, std::vector<Pose> others) {
  VerifyOptions options;
  options.tolerance = static_cast<float>(0.006 * scan.model.diameter);
  std::vector<Eigen::Isometry3f> in_view;
  for (const Pose& other : others) in_view.push_back(testing::in_view(scan.map, other));
  return weigh_rivals(scan.map, scan.model, testing::in_view(scan.map, T), in_view, options);
}

bool alike(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm() < 0.003 && rotation_distance(a, b) < 3 * kDegree;
}

DetectResult detected(const testing::PartScan& scan) {
  testing::PinholeSensor sensor;
  sensor.noise = 1e-4;
  const Model* models[] = {&scan.model};
  return *detect(testing::render(scan.bodies, sensor), models, {}, {});
}

TEST(Rivals, AreThePosesThatShowTheSameFromAPlainSide) {
  const testing::PartScan scan(testing::l_block(), kPlainSide);
  ASSERT_TRUE(scan.model.similar_poses.empty());
  const Rivalry either_way = rivalry(scan, kPlainSide, {kPlainSide, turned(kPlainSide)});
  ASSERT_EQ(either_way.rivals.size(), 1u);
  EXPECT_TRUE(either_way.rivals[0].isApprox(testing::in_view(scan.map, turned(kPlainSide))));
  EXPECT_GT(either_way.odds, 0.3F);
  EXPECT_LT(either_way.odds, 3.0F);
}

TEST(Rivals, AreRuledOutByATellingSide) {
  const testing::PartScan scan(testing::l_block(), kTellingSide);
  EXPECT_TRUE(rivalry(scan, kTellingSide, {turned(kTellingSide)}).rivals.empty());
  EXPECT_GT(rivalry(scan, turned(kTellingSide), {kTellingSide}).odds, 20.0F) << "the truth is no rival of the turn";
}

TEST(Rivals, AreNotTheNeighboursInABin) {
  const Pose beside = Eigen::Translation3d(0.026, 0, 0) * kPlainSide;
  const testing::PartScan scan(testing::l_block(), kPlainSide, {{testing::l_block(), beside}});
  EXPECT_TRUE(rivalry(scan, kPlainSide, {beside}).rivals.empty());
}

TEST(Rivals, AreListedAsVariantsOfThePoseThatIsAnswered) {
  const testing::PartScan scan(testing::l_block(), kPlainSide);
  const DetectResult result = detected(scan);
  ASSERT_EQ(result.hypotheses.size(), 1u);
  const PoseHypothesis& found = result.hypotheses[0];
  EXPECT_GT(found.confidence, 0.3);
  EXPECT_LT(found.confidence, 0.8);
  const bool as_it_is = alike(found.T_scene_model, kPlainSide);
  EXPECT_TRUE(as_it_is || alike(found.T_scene_model, turned(kPlainSide)));
  ASSERT_EQ(found.variants.size(), 1u);
  EXPECT_TRUE(alike(found.variants[0], as_it_is ? turned(kPlainSide) : kPlainSide));
}

TEST(Rivals, AreNoneWhereTheAnswerIsSure) {
  const testing::PartScan scan(testing::l_block(), kTellingSide);
  const DetectResult result = detected(scan);
  ASSERT_EQ(result.hypotheses.size(), 1u);
  EXPECT_TRUE(alike(result.hypotheses[0].T_scene_model, kTellingSide));
  EXPECT_TRUE(result.hypotheses[0].variants.empty());
  EXPECT_EQ(result.hypotheses[0].confidence, 1);
}

}  // namespace
}  // namespace binpose

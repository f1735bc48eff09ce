// What a caller can say of where parts are and how they are answered, on whole searches.

#include <gtest/gtest.h>

#include <cmath>

#include "core/detect/detect.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

const Pose kLeft = testing::pose(40, {1, 0.5, 0.2}, {-0.08, 0, 0.44});
const Pose kRight = testing::pose(110, {0.3, 1, -0.5}, {0.08, 0, 0.45});

/// A block at the left, one at the right.
class Steering : public ::testing::Test {
 protected:
  std::vector<PoseHypothesis> found(const DetectParams& params) const {
    const Model* models[] = {&model_};
    return detect(cloud_, models, params, {})->hypotheses;
  }
  bool is_at(const PoseHypothesis& hypothesis, const Pose& truth) const {
    return (hypothesis.T_scene_model * model_.centre - truth * model_.centre).norm() < 0.02 * model_.diameter;
  }

  const Model model_ = testing::quick_model(testing::l_block());
  const PointCloud cloud_ =
      testing::render(std::vector<testing::PlacedMesh>{{testing::l_block(), kLeft}, {testing::l_block(), kRight}},
                      testing::bin_sensor());
};

OrientedBox box_around(const Vector3d& centre, double size) {
  return {Pose(Eigen::Translation3d(centre)), Vector3d::Constant(size)};
}

TEST_F(Steering, BothBlocksAreFoundWithoutAWord) {
  const std::vector<PoseHypothesis> all = found({});
  ASSERT_GE(all.size(), 2u);
  EXPECT_TRUE((is_at(all[0], kLeft) && is_at(all[1], kRight)) || (is_at(all[0], kRight) && is_at(all[1], kLeft)));
}

TEST_F(Steering, OnlyPartsInARegionAreAnsweredWithTheSamePose) {
  DetectParams params;
  params.space.regions = {box_around(kRight * model_.centre, 0.06)};
  const std::vector<PoseHypothesis> inside = found(params);
  ASSERT_EQ(inside.size(), 1u);
  EXPECT_TRUE(is_at(inside[0], kRight));
  params.space.regions.push_back(box_around(kLeft * model_.centre, 0.06));
  EXPECT_EQ(found(params).size(), 2u);
  params.space.regions = {box_around({0, 0.5, 0.45}, 0.06)};
  EXPECT_TRUE(found(params).empty());
}

TEST_F(Steering, APriorLeavesOutPartsThatLieOtherwise) {
  DetectParams params;
  PosePrior prior;
  prior.model_direction = Vector3d::UnitZ();
  prior.scene_direction = kLeft.linear().col(2);
  prior.max_angle = 15 * kDegree;
  params.space.priors = {prior};
  const std::vector<PoseHypothesis> alike = found(params);
  ASSERT_GE(alike.size(), 1u);
  EXPECT_TRUE(is_at(alike[0], kLeft));
  for (const PoseHypothesis& h : alike) {
    EXPECT_GT(h.T_scene_model.linear().col(2).dot(prior.scene_direction), std::cos(prior.max_angle) - 1e-9);
  }
}

TEST_F(Steering, ADistanceLeavesOutPartsThatAreFarther) {
  const double left = (kLeft * model_.centre).norm(), right = (kRight * model_.centre).norm();
  DetectParams params;
  PosePrior near, far;
  near.max_distance = 0.5 * (left + right);
  far.min_distance = 2;
  params.space.priors = {near};
  for (const PoseHypothesis& h : found(params)) EXPECT_TRUE(is_at(h, left < right ? kLeft : kRight));
  params.space.priors = {far};
  EXPECT_TRUE(found(params).empty());
}

TEST_F(Steering, WhatLiesOutsideOfTheBinOrUnderThePlaneIsNoPart) {
  DetectParams params;
  params.space.bin_interior = OrientedBox{testing::pose(180, Vector3d::UnitX(), {0.16, 0, 0.45}), {0.28, 0.4, 0.3}};
  const std::vector<PoseHypothesis> in_bin = found(params);
  ASSERT_EQ(in_bin.size(), 1u);
  EXPECT_TRUE(is_at(in_bin[0], kRight));
  params.space = {};
  params.space.support_plane = Plane{-Vector3d::UnitX(), 0};  // a wall between them; parts are at the left of it
  const std::vector<PoseHypothesis> left = found(params);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_TRUE(is_at(left[0], kLeft));
}

TEST_F(Steering, MoreEffortSearchesMore) {
  const Model* models[] = {&model_};
  const DetectStats fast = detect(cloud_, models, DetectParams::fast(), {})->stats;
  const DetectStats balanced = detect(cloud_, models, {}, {})->stats;
  const DetectStats thorough = detect(cloud_, models, DetectParams::thorough(), {})->stats;
  EXPECT_LT(fast.start_point_count, balanced.start_point_count);
  EXPECT_LT(balanced.start_point_count, thorough.start_point_count);
  EXPECT_LT(fast.verified_count, balanced.verified_count);
  EXPECT_LT(balanced.verified_count, thorough.verified_count);
}

TEST(SteeringSymmetry, TheEquivalentNearestToTheReferenceIsAnsweredAndTheOthersAreListed) {
  const Model model = testing::quick_model(testing::hexagon());
  ASSERT_EQ(model.symmetry.discrete.size(), 12u);
  const Pose truth = testing::pose(35, {1, 0.3, 0.1}, {0, 0, 0.44});
  const PointCloud cloud =
      testing::render(std::vector<testing::PlacedMesh>{{testing::hexagon(), truth}}, testing::bin_sensor());
  const Model* models[] = {&model};
  DetectParams params;
  params.list_equivalents = true;
  for (const Pose& T_model_model : model.symmetry.discrete) {
    params.reference_orientation = Eigen::Quaterniond((truth * T_model_model).linear());
    const std::vector<PoseHypothesis> found = detect(cloud, models, params, {})->hypotheses;
    ASSERT_GE(found.size(), 1u);
    EXPECT_LT(rotation_distance(found[0].T_scene_model, truth * T_model_model), 3 * kDegree);
    ASSERT_EQ(found[0].equivalents.size(), 11u);
    for (const Pose& other : found[0].equivalents) {
      EXPECT_GT(rotation_distance(other, truth * T_model_model), 50 * kDegree);
      EXPECT_LT((other * model.centre - truth * model.centre).norm(), 0.02 * model.diameter);
    }
  }
}

}  // namespace
}  // namespace binpose

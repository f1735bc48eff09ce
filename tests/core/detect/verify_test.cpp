#include "core/detect/verify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

struct VerifiedScan : testing::PartScan {
  using PartScan::PartScan;

  VerifyOptions options() const {
    VerifyOptions options;
    options.tolerance = static_cast<float>(0.012 * model.diameter);
    return options;
  }
  Evidence evidence(const Pose& T_scene_model) const {
    return verify(map, model, testing::in_view(map, T_scene_model), options());
  }
  /// The true pose, moved in the scene by shares of the diameter.
  Pose moved(const Vector3d& by) const {
    Pose T = T_scene_model;
    T.pretranslate(model.diameter * by);
    return T;
  }
};

const Pose kLying = testing::pose(30, Vector3d::UnitZ(), {0, -0.01, 0.4875});  // flat on the floor at 0.5 m
const Pose kTilted = testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43});

TEST(Verify, ExplainsNearlyAllAtTheTruth) {
  for (const Pose& pose : {kLying, kTilted}) {
    const VerifiedScan scan(testing::l_block(), pose);
    const Evidence evidence = scan.evidence(pose);
    EXPECT_GT(evidence.explained, 0.9F);
    EXPECT_LT(evidence.violated, 0.04F);
    EXPECT_LT(evidence.occluded, 0.02F);
    EXPECT_GT(evidence.outline_confirmed, 5 * evidence.outline_contradicted);
    EXPECT_GT(evidence.score(), 0.75F);
    EXPECT_LT(evidence.residual, 0.003 * scan.model.diameter);
  }
}

/// What verify() computes for eight points at a time, one point after the other.
Evidence surface_evidence_by_loop(const VerifiedScan& scan, const Eigen::Isometry3f& T, const VerifyOptions& options) {
  Evidence sum;
  double total = 0;
  const float slack = options.tolerance + 1.5F * scan.map.pixel_size;
  for (const std::uint16_t i : visible_points(scan.model, T)) {
    const Eigen::Vector3f p = T * scan.model.surface[i].position;
    const Eigen::Vector3f normal = T.linear() * scan.model.surface[i].normal;
    const float facing = -normal.dot(p.normalized());
    if (facing < 0.25882F) continue;
    total += facing;
    const int pixel = scan.map.pixel_of(p);
    if (pixel < 0 || !scan.map.measured(pixel)) continue;
    const float distance = std::abs(normal.dot(scan.map.pixels[pixel].position - p));
    const float step = scan.map.pixels[pixel].position.z() - p.z();
    if (distance <= options.tolerance && std::abs(step) < 3 * slack) {
      const bool same = !scan.map.background[pixel] && scan.map.has_normal(pixel) &&
                        normal.dot(scan.map.pixels[pixel].normal) >= options.normal_cosine;
      (same ? sum.explained : sum.unexplained) += facing;
    } else {
      (step > slack ? sum.violated : step < -slack ? sum.occluded : sum.unexplained) += facing;
    }
  }
  for (float* share : {&sum.explained, &sum.unexplained, &sum.violated, &sum.occluded}) {
    *share /= static_cast<float>(total);
  }
  return sum;
}

/// Calls `use(scan, T_view_model)` for true and shifted poses of a part that something hides in part.
template <typename Use>
void for_each_tried_pose(Use&& use) {
  const testing::PlacedMesh in_front = {testing::box({0.03F, 0.03F, 0.01F}),
                                        testing::pose(0, Vector3d::UnitZ(), {0, 0, 0.36})};
  for (const Pose& pose : {kLying, kTilted}) {
    const VerifiedScan scan(testing::l_block(), pose, {in_front});
    for (const Vector3d& by : {Vector3d(0, 0, 0), Vector3d(0.05, 0, 0), Vector3d(0, 0.1, -0.03)}) {
      const Eigen::Isometry3f T = testing::in_view(scan.map, scan.moved(by));
      use(scan, T);
    }
  }
}

/// How far the scene lies behind an outline point's surface carried on along `outward`; NaN where nothing was measured.
float depth_behind_by_hand(const DepthMap& map, const ContourPoint& contour, const Eigen::Isometry3f& T, float distance,
                           float steepest) {
  const Eigen::Vector3f p = T * contour.position, normal = T.linear() * contour.normal;
  const Eigen::Vector3f outward = T.linear() * contour.outward;
  const int pixel = map.pixel_of(p + distance * outward);
  if (pixel < 0 || !map.measured(pixel)) return NAN;
  const float slope = std::clamp(normal.dot(outward) / std::max(-normal.z(), 0.05F), -steepest, steepest);
  return (map.pixels[pixel].position.z() - p.z() - slope * distance) / std::sqrt(1 + slope * slope);
}

/// Outline points confirmed and contradicted, one point after the other: there up to a pixel inside, gone two outside.
std::pair<int, int> outline_by_loop(const VerifiedScan& scan, const Eigen::Isometry3f& T, float tolerance) {
  int confirmed = 0, contradicted = 0;
  for (const ContourPoint& contour : scan.model.outlines[nearest_viewpoint(scan.model, T)]) {
    const float inside = depth_behind_by_hand(scan.map, contour, T, -scan.map.pixel_size, 5);
    const float outside = depth_behind_by_hand(scan.map, contour, T, 2 * scan.map.pixel_size, 1);
    if (inside < -tolerance) continue;  // hidden
    if (inside > tolerance) {
      ++contradicted;
    } else if (outside > tolerance) {
      ++confirmed;
    } else if (outside >= -tolerance) {
      ++contradicted;
    }
  }
  return {confirmed, contradicted};
}

TEST(Verify, ComparesEightOutlinePointsAtATimeAsALoopDoesOneByOne) {
  for_each_tried_pose([](const VerifiedScan& scan, const Eigen::Isometry3f& T) {
    const Evidence fast = verify(scan.map, scan.model, T, scan.options());
    const auto [confirmed, contradicted] = outline_by_loop(scan, T, scan.options().tolerance);
    const auto count = static_cast<float>(scan.model.outlines[nearest_viewpoint(scan.model, T)].size());
    EXPECT_GT(confirmed + contradicted, 10);
    // A point on a limit may fall to either side.
    EXPECT_NEAR(fast.outline_confirmed * count, static_cast<float>(confirmed), 1.5F);
    EXPECT_NEAR(fast.outline_contradicted * count, static_cast<float>(contradicted), 1.5F);
  });
}

TEST(Verify, ComparesEightPointsAtATimeAsALoopDoesOneByOne) {
  for_each_tried_pose([](const VerifiedScan& scan, const Eigen::Isometry3f& T) {
    const Evidence fast = verify(scan.map, scan.model, T, scan.options());
    const Evidence slow = surface_evidence_by_loop(scan, T, scan.options());
    // A point on a limit may fall to either side.
    EXPECT_NEAR(fast.explained, slow.explained, 2e-3F);
    EXPECT_NEAR(fast.unexplained, slow.unexplained, 2e-3F);
    EXPECT_NEAR(fast.violated, slow.violated, 2e-3F);
    EXPECT_NEAR(fast.occluded, slow.occluded, 2e-3F);
  });
}

TEST(Verify, SharesAddUpToAtMostAll) {
  const VerifiedScan scan(testing::l_block(), kTilted);
  for (const double by : {0.0, 0.05, 0.2, 0.5, -0.1}) {
    const Evidence e = scan.evidence(scan.moved({by, by / 2, by / 3}));
    EXPECT_LE(e.explained + e.violated + e.occluded + e.unexplained, 1.001F);
    EXPECT_LE(e.outline_confirmed + e.outline_contradicted, 1.001F);
    EXPECT_GE(e.score(), 0);
    EXPECT_LE(e.score(), 1);
  }
}

TEST(Verify, ScoresAShiftedPoseFarBelowTheTruth) {
  const VerifiedScan scan(testing::l_block(), kTilted);
  const float truth = scan.evidence(scan.T_scene_model).score();
  for (const Vector3d& by : {Vector3d(0.15, 0, 0), Vector3d(0, -0.15, 0), Vector3d(0, 0, 0.1), Vector3d(0, 0, -0.1)}) {
    EXPECT_LT(scan.evidence(scan.moved(by)).score(), 0.4F * truth) << by.transpose();
  }
}

TEST(Verify, CallsAPoseInFrontOfTheSceneViolatedAndOneBehindItOccluded) {
  const VerifiedScan scan(testing::l_block(), kLying);
  const Evidence front = scan.evidence(scan.moved({0, 0, -0.15}));
  EXPECT_GT(front.violated, 0.9F);
  EXPECT_EQ(front.score(), 0);
  const Evidence behind = scan.evidence(scan.moved({0, 0, 0.15}));
  EXPECT_GT(behind.occluded, 0.9F);
  EXPECT_LT(behind.score(), 0.05F);
}

TEST(Verify, CallsWhatLiesUnderAnotherPartOccluded) {
  const VerifiedScan scan(testing::l_block(), kLying,
                          {{testing::box({0.2F, 0.05F, 0.01F}), testing::pose(0, Vector3d::UnitZ(), {0, 0.03, 0.42})}});
  // The share that rays to the visible points do not reach.
  double hidden = 0, all = 0;
  const Eigen::Isometry3f T_view_model = testing::in_view(scan.map, kLying);
  for (const std::uint16_t i : visible_points(scan.model, T_view_model)) {
    const Vector3d p = kLying * scan.model.surface[i].position.cast<double>();
    const Vector3d normal = kLying.linear() * scan.model.surface[i].normal.cast<double>();
    const double weight = -normal.dot(p.normalized());
    if (weight < 0.26) continue;
    const auto hit = testing::cast_ray(scan.bodies, Vector3d::Zero(), p);
    all += weight;
    hidden += hit && hit->body == 0 ? weight : 0;
  }
  ASSERT_GT(hidden / all, 0.2);
  const Evidence evidence = scan.evidence(kLying);
  EXPECT_NEAR(evidence.occluded, hidden / all, 0.05);
  EXPECT_NEAR(evidence.explained, 1 - hidden / all, 0.08);
  EXPECT_LT(evidence.violated, 0.02F);
}

TEST(Verify, DoesNotFallForAFlatFacePosedInsideALargerOne) {
  // Top face at the height of the floor: every point is there, but the surface goes on at its rim.
  const VerifiedScan scan(testing::hexagon(), testing::pose(0, Vector3d::UnitZ(), {0.04, 0, 0.494}));
  const Pose in_floor = testing::pose(10, Vector3d::UnitZ(), {-0.04, 0, 0.506});
  const Evidence evidence = scan.evidence(in_floor);
  EXPECT_GT(evidence.explained, 0.9F);
  EXPECT_GT(evidence.outline_contradicted, 0.8F);
  EXPECT_LT(evidence.score(), 0.1F);
  EXPECT_GT(scan.evidence(scan.T_scene_model).score(), 0.7F);
}

TEST(Verify, LeavesOwnedPixelsUnexplained) {
  const VerifiedScan scan(testing::l_block(), kTilted);
  const std::vector<int> all(scan.map.pixels.size(), 0), none(scan.map.pixels.size(), -1);
  const Eigen::Isometry3f T = testing::in_view(scan.map, kTilted);
  EXPECT_EQ(verify(scan.map, scan.model, T, scan.options(), &all).explained, 0);
  EXPECT_EQ(verify(scan.map, scan.model, T, scan.options(), &none).explained, scan.evidence(kTilted).explained);
}

TEST(Verify, ExplainsNothingByTheBackground) {
  VerifiedScan scan(testing::l_block(), kTilted);
  scan.map.background.assign(scan.map.pixels.size(), 1);
  EXPECT_EQ(scan.evidence(kTilted).explained, 0);
}

TEST(Verify, OfFewPointsIsCloseToThatOfAll) {
  const VerifiedScan scan(testing::l_block(), kTilted);
  VerifyOptions few = scan.options();
  few.most_points = 80;
  for (const double by : {0.0, 0.03, 0.06}) {
    const Pose T = scan.moved({by, 0, 0});
    EXPECT_NEAR(verify(scan.map, scan.model, testing::in_view(scan.map, T), few).explained, scan.evidence(T).explained,
                0.12);
  }
}

TEST(Verify, OfPosesOutOfSightIsNoEvidence) {
  const VerifiedScan scan(testing::l_block(), kTilted);
  for (const Vector3d& at : {Vector3d(0, 0, -0.5), Vector3d(5, 0, 0.5), Vector3d(0, 0, 0), Vector3d(1e30, 0, 1e30)}) {
    EXPECT_LT(scan.evidence(testing::pose(0, Vector3d::UnitZ(), at)).score(), 0.01F) << at.transpose();
  }
}

TEST(AlignmentScore, IsOneLessTheMeanDistanceOverTheCutoff) {
  const VerifiedScan scan(testing::l_block(), kLying);
  const auto cutoff = static_cast<float>(0.1 * scan.model.diameter);
  const auto score = [&](const Pose& T) {
    return alignment_score(scan.map, scan.model, testing::in_view(scan.map, T), cutoff);
  };
  double sum = 0;
  for (std::size_t i = 0; i < 500; ++i) {
    const Eigen::Vector3f p = testing::in_view(scan.map, kLying) * scan.model.surface[i].position;
    sum += std::min(cutoff, (scan.map.pixels[scan.map.pixel_of(p)].position - p).norm()) / cutoff;
  }
  EXPECT_NEAR(score(kLying), 1 - sum / 500, 1e-4);
  EXPECT_NEAR(score(scan.moved({0, 0, -0.9})), 0, 1e-4F);
}

}  // namespace
}  // namespace binpose

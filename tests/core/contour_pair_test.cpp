#include "core/contour_pair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/params.h"
#include "tests/scenes/random.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

/// A contour point in the plane z = height whose surface ends in a direction of the plane.
ContourPoint on_rim(float x, float y, float outward_degrees, float height = 0) {
  const auto angle = static_cast<float>(outward_degrees * kDegree);
  return {{x, y, height}, {0, 0, 1}, {std::cos(angle), std::sin(angle), 0}};
}

TEST(ContourFrame, RunsFromAToBUnderTheCommonNormal) {
  const std::optional<ContourFrame> frame =
      contour_frame(on_rim(0.1F, 0.2F, 90), on_rim(0.1F, 0.25F, 180), 0.01F, 0.1F, 0.001F);
  ASSERT_TRUE(frame.has_value());
  EXPECT_TRUE(frame->T_outer_pair.translation().isApprox(Vector3f(0.1F, 0.2F, 0)));
  EXPECT_TRUE(frame->T_outer_pair.linear().col(0).isApprox(Vector3f(0, 1, 0), 1e-5F));
  EXPECT_TRUE(frame->T_outer_pair.linear().col(2).isApprox(Vector3f(0, 0, 1), 1e-5F));
  EXPECT_NEAR(frame->feature.distance, 0.05F, 1e-6F);
  EXPECT_NEAR(frame->feature.angle_a, 0, 1e-5F);
  EXPECT_NEAR(frame->feature.angle_b, kPi / 2, 1e-5F);
}

TEST(ContourFrame, DoesNotExistOutsideOfItsLimits) {
  const ContourPoint a = on_rim(0, 0, 90);
  const auto exists = [&](const ContourPoint& b) { return contour_frame(a, b, 0.02F, 0.07F, 0.002F).has_value(); };
  EXPECT_TRUE(exists(on_rim(0.05F, 0, 90)));
  EXPECT_FALSE(exists(on_rim(0.019F, 0, 90))) << "too near";
  EXPECT_FALSE(exists(on_rim(0.071F, 0, 90))) << "too far";
  EXPECT_TRUE(exists(on_rim(0.05F, 0, 90, 0.0019F)));
  EXPECT_FALSE(exists(on_rim(0.05F, 0, 90, 0.0021F))) << "another plane";
  ContourPoint turned = on_rim(0.05F, 0, 90);
  turned.normal = Vector3f(0, std::sin(16 * static_cast<float>(kDegree)), std::cos(16 * static_cast<float>(kDegree)));
  EXPECT_FALSE(exists(turned)) << "another normal";
}

TEST(ContourFrame, GivesTheRotationAndPlaceOfAMovedPair) {
  scenes::Random random(5);
  const ContourPoint a = on_rim(0.01F, 0.02F, 100), b = on_rim(0.05F, -0.01F, 20);
  const Eigen::Isometry3f T_model_pair = contour_frame(a, b, 0, 1, 1)->T_outer_pair;
  for (int i = 0; i < 20; ++i) {
    Eigen::Isometry3f T_scene_model(random.rotation().cast<float>());
    T_scene_model.translation() = Vector3f(0.2F, 0.1F, 0.6F);
    const auto moved = [&](const ContourPoint& c) {
      return ContourPoint{T_scene_model * c.position, T_scene_model.linear() * c.normal,
                          T_scene_model.linear() * c.outward};
    };
    const std::optional<ContourFrame> frame = contour_frame(moved(a), moved(b), 0, 1, 1);
    ASSERT_TRUE(frame.has_value());
    EXPECT_TRUE((frame->T_outer_pair * T_model_pair.inverse()).isApprox(T_scene_model, 1e-4F));
  }
}

/// Pairs of a rim in the plane z = 0; the weight tells them apart.
struct RimPairs {
  std::vector<ContourPoint> points;
  std::vector<ContourPair> pairs;
  std::vector<float> weights;

  RimPairs() {
    scenes::Random random(11);
    for (int i = 0; i < 60; ++i) {
      points.push_back(on_rim(static_cast<float>(random.uniform(-0.05, 0.05)),
                              static_cast<float>(random.uniform(-0.05, 0.05)),
                              static_cast<float>(random.uniform(-180, 180))));
    }
    for (std::uint16_t a = 0; a < 60; ++a) {
      for (std::uint16_t b = a + 1; b < 60; ++b) {
        const float distance = (points[a].position - points[b].position).norm();
        if (distance < 0.02F || distance > 0.07F) continue;
        pairs.push_back({a, b});
        weights.push_back(static_cast<float>(pairs.size()));
      }
    }
  }
};

/// How far two angles lie apart.
float turn(float a, float b) { return std::abs(std::remainder(a - b, 2 * kPi)); }

TEST(ContourTable, FindsJustThePairsOfALinearScanInEitherOrder) {
  constexpr float kDiameter = 0.1F, kLengthLimit = 0.018F * kDiameter;
  const auto kAngleLimit = static_cast<float>(15 * kDegree);
  const RimPairs rim;
  const ContourTable table(rim.points, rim.pairs, rim.weights, Eigen::Vector3f::Zero(), kDiameter);
  scenes::Random random(12);
  for (int trial = 0; trial < 3000; ++trial) {
    const ContourFeature wanted = {static_cast<float>(random.uniform(0.02, 0.07)),
                                   static_cast<float>(random.uniform(-kPi, kPi)),
                                   static_cast<float>(random.uniform(-kPi, kPi))};
    std::vector<float> expected, found;
    bool at_a_limit = false;
    for (std::size_t i = 0; i < rim.pairs.size(); ++i) {
      for (const auto& [a, b] :
           {std::pair(rim.pairs[i].a, rim.pairs[i].b), std::pair(rim.pairs[i].b, rim.pairs[i].a)}) {
        const ContourFeature f = contour_frame(rim.points[a], rim.points[b], 0, 1, 1)->feature;
        const float excess =
            std::max({std::abs(f.distance - wanted.distance) / kLengthLimit,
                      turn(f.angle_a, wanted.angle_a) / kAngleLimit, turn(f.angle_b, wanted.angle_b) / kAngleLimit});
        at_a_limit = at_a_limit || std::abs(excess - 1) < 1e-3F;
        if (excess <= 1) expected.push_back(rim.weights[i]);
      }
    }
    if (at_a_limit) continue;
    table.for_each_match(wanted, [&](const ContourTable::Vote& vote) { found.push_back(vote.weight); });
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found, expected) << trial;
  }
}

TEST(ContourTable, LeadsFromAMatchToThePose) {
  const RimPairs rim;
  const ContourTable table(rim.points, rim.pairs, rim.weights, {0.01F, 0.02F, 0.03F}, 0.1F);
  const ContourFrame frame = *contour_frame(rim.points[rim.pairs[0].a], rim.points[rim.pairs[0].b], 0, 1, 1);
  bool unmoved = false;
  table.for_each_match(frame.feature, [&](const ContourTable::Vote& vote) {
    const Eigen::Vector3f centre = frame.T_outer_pair * vote.centre_in_pair;
    const Eigen::Quaternionf turn = Eigen::Quaternionf(frame.T_outer_pair.linear()) * vote.rotation_pair_model;
    unmoved = unmoved || (centre.isApprox(Eigen::Vector3f(0.01F, 0.02F, 0.03F), 1e-3F) && std::abs(turn.w()) > 0.9999F);
  });
  EXPECT_TRUE(unmoved);
}

TEST(ContourTable, OfNoPairsFindsNone) {
  ContourTable().for_each_match({0.05F, 0, 0}, [](const ContourTable::Vote&) { FAIL(); });
  ContourTable({}, {}, {}, {0, 0, 0}, 0.1F).for_each_match({0.05F, 0, 0}, [](const ContourTable::Vote&) { FAIL(); });
}

}  // namespace
}  // namespace binpose

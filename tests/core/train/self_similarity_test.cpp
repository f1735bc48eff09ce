#include "core/train/self_similarity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/train/mesh_extent.h"
#include "core/train/sample_surface.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

/// A part as training sees it.
struct Part {
  double diameter;
  std::vector<SurfacePoint> dense, surface;

  explicit Part(const Mesh& mesh)
      : diameter(mesh_extent(mesh).diameter),
        dense(scatter(mesh, 0.007 * diameter)),
        surface(thin_evenly(dense, 0.015 * diameter)) {}
  SelfSimilarity search() const { return find_self_similarity(dense, surface, diameter, {}); }
};

TEST(SelfSimilarity, OfAnLIsTheIdentityAlone) {
  const SelfSimilarity found = Part(testing::l_block()).search();
  EXPECT_EQ(found.symmetry.discrete.size(), 1u);
  EXPECT_FALSE(found.symmetry.has_axis);
}

TEST(SelfSimilarity, OfABoxOfThreeLengthsIsItsFourTurns) {
  const Part part(testing::box({0.08F, 0.05F, 0.03F}));
  const SelfSimilarity found = part.search();
  EXPECT_EQ(found.symmetry.discrete.size(), 4u);
  for (const Pose& T : found.symmetry.discrete) {
    const double angle = Eigen::AngleAxisd(T.linear()).angle();
    EXPECT_TRUE(angle < kDegree || std::abs(angle - 180 * kDegree) < kDegree) << angle;
    EXPECT_LT(T.translation().norm(), 0.01 * part.diameter);
  }
}

TEST(SelfSimilarity, OfAHexagonIsItsTwelveTurns) {
  const SelfSimilarity found = Part(testing::hexagon()).search();
  EXPECT_EQ(found.symmetry.discrete.size(), 12u);
  EXPECT_FALSE(found.symmetry.has_axis);
}

TEST(SelfSimilarity, OfAShaftIsItsAxis) {
  const SelfSimilarity found = Part(testing::stepped_shaft()).search();
  ASSERT_TRUE(found.symmetry.has_axis);
  EXPECT_GT(std::abs(found.symmetry.axis_direction.z()), 0.9995);
  EXPECT_LT(found.symmetry.axis_point.head<2>().norm(), 0.001);
  EXPECT_EQ(found.symmetry.discrete.size(), 1u);
}

TEST(SelfSimilarity, CallsAMarkedHexagonSimilarNotSymmetric) {
  const Part part(testing::marked_hexagon());
  const SelfSimilarity found = part.search();
  EXPECT_EQ(found.symmetry.discrete.size(), 1u);
  int sixths = 0;
  for (const Pose& T : found.similar) {
    const double angle = Eigen::AngleAxisd(T.linear()).angle();
    sixths += std::abs(std::remainder(angle, 60 * kDegree)) < 2 * kDegree;
  }
  EXPECT_GE(sixths, 5);
  const std::vector<SurfacePoint> telling = telling_points(part.dense, found.similar, part.diameter);
  EXPECT_FALSE(telling.empty());
  EXPECT_LT(telling.size(), part.dense.size());
}

/// Angles of the turns about z that keep its direction, degrees in [0, 360), ascending.
std::vector<double> angles_about_z(const std::vector<Pose>& turns) {
  std::vector<double> angles;
  for (const Pose& T : turns) {
    if (T.linear()(2, 2) < 0.99) continue;
    const double angle = std::atan2(T.linear()(1, 0), T.linear()(0, 0)) / kDegree;
    angles.push_back(angle < 0 ? angle + 360 : angle);
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

TEST(SelfSimilarity, OfAPinnedDiscGoesAllRoundInEvenSteps) {
  const SelfSimilarity found = Part(testing::pinned_disc()).search();
  EXPECT_FALSE(found.symmetry.has_axis);
  EXPECT_EQ(found.symmetry.discrete.size(), 1u);
  const std::vector<double> angles = angles_about_z(found.similar);
  ASSERT_EQ(angles.size(), 31u);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    EXPECT_NEAR(angles[i], 360.0 / 32 * static_cast<double>(i + 1), 1) << i;
  }
}

/// A wheel of 18 teeth, one of which is marked.
Mesh marked_gear() {
  constexpr int kTeeth = 18;
  std::vector<Eigen::Vector2f> outline;
  for (int i = 0; i < 2 * kTeeth; ++i) {
    const float angle = static_cast<float>(360 * kDegree * i / (2 * kTeeth));
    outline.emplace_back((i % 2 == 0 ? 0.03F : 0.025F) * Eigen::Vector2f(std::cos(angle), std::sin(angle)));
  }
  return testing::joined(testing::extrude(outline, 0.02F),
                         testing::shifted(testing::box({0.006F, 0.006F, 0.004F}), {0.015F, 0, 0.012F}));
}

TEST(SelfSimilarity, OfAMarkedGearIsFromToothToTooth) {
  const SelfSimilarity found = Part(marked_gear()).search();
  EXPECT_FALSE(found.symmetry.has_axis);
  const std::vector<double> angles = angles_about_z(found.similar);
  EXPECT_GE(angles.size(), 12u);
  for (const double angle : angles) EXPECT_NEAR(std::remainder(angle, 20), 0, 2) << angle;
}

/// A round head with a hexagon so small that turns by up to 20 degrees leave it on itself to within the tolerance.
Mesh screw_head() {
  const Eigen::Vector2f head[] = {{0, -0.01F}, {0.02F, -0.01F}, {0.02F, 0.01F}, {0, 0.01F}};
  std::vector<Eigen::Vector2f> hexagon;
  for (int i = 0; i < 6; ++i) {
    const float angle = static_cast<float>(60 * kDegree * i);
    hexagon.emplace_back(0.0055F * std::cos(angle), 0.0055F * std::sin(angle));
  }
  return testing::joined(testing::revolve(head, 96),
                         testing::shifted(testing::extrude(hexagon, 0.01F), {0, 0, 0.015F}));
}

TEST(SelfSimilarity, OfASmallHexagonIsItsSixTurnsNotWhatIsNearThem) {
  const SelfSimilarity found = Part(screw_head()).search();
  EXPECT_FALSE(found.symmetry.has_axis);
  EXPECT_EQ(found.symmetry.discrete.size(), 6u);
  for (const Pose& T : found.symmetry.discrete) {
    const double angle = Eigen::AngleAxisd(T.linear()).angle();
    EXPECT_LT(std::abs(std::remainder(angle, 60 * kDegree)), kDegree) << angle / kDegree;
  }
}

TEST(SelfSimilarity, IsTheSameEveryTime) {
  const Part part(testing::hexagon());
  const SelfSimilarity once = part.search(), again = part.search();
  ASSERT_EQ(once.symmetry.discrete.size(), again.symmetry.discrete.size());
  for (std::size_t i = 0; i < once.symmetry.discrete.size(); ++i) {
    EXPECT_EQ(once.symmetry.discrete[i].matrix(), again.symmetry.discrete[i].matrix());
  }
}

TEST(SelfSimilarity, OfAStoppedSearchIsTheIdentity) {
  std::stop_source stop;
  stop.request_stop();
  const Part part(testing::hexagon());
  RunControl control;
  control.stop = stop.get_token();
  EXPECT_EQ(find_self_similarity(part.dense, part.surface, part.diameter, control).symmetry.discrete.size(), 1u);
}

}  // namespace
}  // namespace binpose

#include "core/train/vector_pairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <tuple>

#include "core/train/sample_surface.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

constexpr double kDiameter = 0.1;
constexpr double kTolerance = 0.02;

using Indices = std::tuple<int, int, int>;

std::vector<Indices> indices_of(const std::vector<VectorPair>& pairs) {
  std::vector<Indices> indices;
  indices.reserve(pairs.size());
  for (const VectorPair& pair : pairs) indices.emplace_back(pair.p, pair.q1, pair.q2);
  return indices;
}

TEST(VectorPairs, AreThoseOfATripleLoop) {
  const std::vector<SurfacePoint> points = thin_evenly(scatter(testing::l_block(), 0.0015), 0.009);
  const PairLengths lengths{0.30, 0.22};
  const auto fits = [](double distance, double relative) {
    return std::abs(distance - relative * kDiameter) <= kTolerance * kDiameter;
  };
  std::vector<Indices> expected;
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (std::size_t q1 = 0; q1 < points.size(); ++q1) {
      for (std::size_t q2 = 0; q2 < points.size(); ++q2) {
        const Eigen::Vector3f a = points[q1].position - points[p].position,
                              b = points[q2].position - points[p].position;
        if (fits(a.norm(), lengths.relative_q1) && fits(b.norm(), lengths.relative_q2) &&
            std::abs(a.dot(b)) <= 0.07F * a.norm() * b.norm()) {
          expected.emplace_back(p, q1, q2);
        }
      }
    }
  }
  const std::vector<VectorPair> pairs = vector_pairs(points, lengths, kTolerance, kDiameter, 3, {});
  EXPECT_GT(pairs.size(), 500u);
  EXPECT_EQ(indices_of(pairs), expected);
  for (const VectorPair& pair : pairs) EXPECT_EQ(pair.scale, 3);
}

TEST(VectorPairs, OfThreePointsAtARightAngleIsOne) {
  const Eigen::Vector3f up(0, 0, 1);
  const std::vector<SurfacePoint> points = {{{0, 0, 0}, up}, {{0.03F, 0, 0}, up}, {{0, 0.022F, 0}, up}};
  const std::vector<VectorPair> pairs = vector_pairs(points, {0.30, 0.22}, kTolerance, kDiameter, 0, {});
  ASSERT_EQ(indices_of(pairs), std::vector<Indices>({{0, 1, 2}}));
}

TEST(VectorPairs, EndEmptyWhenStopped) {
  std::stop_source source;
  source.request_stop();
  RunControl control;
  control.stop = source.get_token();
  const std::vector<SurfacePoint> points = thin_evenly(scatter(testing::l_block(), 0.0015), 0.009);
  EXPECT_TRUE(vector_pairs(points, {0.30, 0.22}, kTolerance, kDiameter, 0, control).empty());
}

/// Pairs in a plane, of which all but the last few lie flat.
TEST(OccurrenceProbability, IsTheShareOfPairsWithTheFeature) {  // Eq. (2-4)
  const Eigen::Vector3f up(0, 0, 1), side(1, 0, 0);
  const std::vector<SurfacePoint> points = {
      {{0, 0, 0}, up}, {{0.03F, 0, 0}, up}, {{0, 0.02F, 0}, up}, {{0.03F, 0, 0}, side}, {{0, 0.02F, 0}, side}};
  const std::vector<VectorPair> pairs = {
      {0, 1, 2, 0},  // f = (1, 1, 1)
      {0, 1, 2, 0},  // f = (1, 1, 1)
      {0, 3, 2, 0},  // f = (1, 0, 1)
      {0, 1, 4, 0},  // f = (1, 1, 0)
      {0, 2, 1, 0},  // f = (-1, -1, -1): seen in the other order the triangle looks down
      {0, 1, 2, 0},  // f = (1, 1, 1)
      {0, 3, 4, 0},  // f = (1, 0, 0)
      {0, 3, 2, 0},  // f = (1, 0, 1)
  };
  const std::vector<double> ph = occurrence_probability(points, pairs, FeatureBins(12 * kDegree));
  const std::vector<double> expected = {3 / 8.0, 3 / 8.0, 2 / 8.0, 1 / 8.0, 1 / 8.0, 3 / 8.0, 1 / 8.0, 2 / 8.0};
  ASSERT_EQ(ph.size(), expected.size());
  for (std::size_t i = 0; i < ph.size(); ++i) EXPECT_DOUBLE_EQ(ph[i], expected[i]) << i;
}

TEST(OccurrenceProbability, CountsEachPairByItsWeight) {
  const Eigen::Vector3f up(0, 0, 1), side(1, 0, 0);
  const std::vector<SurfacePoint> points = {
      {{0, 0, 0}, up}, {{0.03F, 0, 0}, up}, {{0, 0.02F, 0}, up}, {{0, 0, 0}, side}};
  const std::vector<VectorPair> pairs = {{0, 1, 2, 0}, {3, 1, 2, 0}, {0, 1, 2, 0}};
  const std::vector<double> seen = {0.5, 0.1, 0.2};
  const std::vector<double> ph = occurrence_probability(points, pairs, FeatureBins(12 * kDegree), {}, seen);
  EXPECT_DOUBLE_EQ(ph[0], 0.7 / 0.8);
  EXPECT_DOUBLE_EQ(ph[1], 0.1 / 0.8);
  EXPECT_DOUBLE_EQ(ph[2], 0.7 / 0.8);
}

TEST(OccurrenceProbability, AgreesWithAMapOfFeatures) {
  const std::vector<SurfacePoint> points = thin_evenly(scatter(testing::stepped_shaft(), 0.0015), 0.008);
  const std::vector<VectorPair> pairs = vector_pairs(points, {0.30, 0.22}, kTolerance, kDiameter, 0, {});
  const FeatureBins bins(12 * kDegree);
  const auto feature = [&](const VectorPair& v) {
    const SurfacePoint &p = points[v.p], &q1 = points[v.q1], &q2 = points[v.q2];
    const PairNormals n = pair_normals(pair_frame(p.position, q1.position, q2.position), p, q1, q2);
    return Indices(bins.axis_bin(n(2, 0)), bins.axis_bin(n(2, 1)), bins.axis_bin(n(2, 2)));
  };
  std::map<Indices, double> histogram;
  for (const VectorPair& pair : pairs) ++histogram[feature(pair)];
  const std::vector<double> ph = occurrence_probability(points, pairs, bins);
  ASSERT_GT(pairs.size(), 300u);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ASSERT_DOUBLE_EQ(ph[i], histogram[feature(pairs[i])] / static_cast<double>(pairs.size()));
  }
}

}  // namespace
}  // namespace binpose

#include "core/train/contour_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace binpose {
namespace {

using Eigen::Vector3f;

constexpr double kRimDiameter = 0.1;
constexpr int kViews = 100;

/// A point on a circle of 80 mm in the plane z = 0, whose surface ends outwards.
ContourPoint on_circle(int i, int count) {
  const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(count);
  const Vector3f outward(std::cos(angle), std::sin(angle), 0);
  return {0.04F * outward, {0, 0, 1}, outward};
}

TEST(PoolContours, MergesWhatSeveralViewsShowOfOnePiece) {
  std::vector<std::vector<ContourPoint>> views(kViews);
  for (const int k : {3, 64, 70}) {
    ContourPoint c = on_circle(0, 8);
    c.position.x() += 1e-6F * static_cast<float>(k);
    c.outward = Vector3f(0.9F, 0, 0.1F * static_cast<float>(k) / 70).normalized();  // across that view
    views[k].push_back(c);
  }
  const std::vector<PooledContour> pooled = pool_contours(views, 0.003);
  ASSERT_EQ(pooled.size(), 1u);
  EXPECT_TRUE(pooled[0].point.position.isApprox(Vector3f(0.04F + 1e-6F * 137 / 3, 0, 0), 1e-4F));
  EXPECT_TRUE(pooled[0].point.outward.isApprox(Vector3f(1, 0, 0), 1e-5F)) << "turned into the tangent plane";
  for (int k = 0; k < kViews; ++k) EXPECT_EQ(sees(pooled[0].views, k), k == 3 || k == 64 || k == 70) << k;
}

TEST(PoolContours, KeepsApartWhatLooksElsewhere) {
  const ContourPoint a = on_circle(0, 8);
  ContourPoint other_place = a, other_normal = a, other_outward = a;
  other_place.position.x() += 0.01F;
  other_normal.normal = {0, 1, 0};
  other_outward.outward = {0, 1, 0};
  std::vector<std::vector<ContourPoint>> views(kViews);
  for (const int k : {10, 20}) views[k] = {a, other_place, other_normal, other_outward};
  EXPECT_EQ(pool_contours(views, 0.003).size(), 4u);
}

TEST(PoolContours, DropsWhatFewViewsShowAndTheSidesOfRoundedSurfaces) {
  ContourPoint rounded = on_circle(2, 8);
  rounded.outward = {0, 0.2F, -1};  // nearly against the normal
  std::vector<std::vector<ContourPoint>> views(kViews);
  for (int k = 0; k < 50; ++k) views[k].push_back(rounded);
  views[7].push_back(on_circle(0, 8));
  EXPECT_TRUE(pool_contours(views, 0.003).empty());
}

TEST(PoolContours, PutsThoseOfMostViewsFirst) {
  std::vector<std::vector<ContourPoint>> views(kViews);
  for (int i = 0; i < 8; ++i) {
    for (int k = 0; k < 10 + 3 * i; ++k) views[k].push_back(on_circle(i, 8));
  }
  const std::vector<PooledContour> pooled = pool_contours(views, 0.003);
  ASSERT_EQ(pooled.size(), 8u);
  EXPECT_TRUE(pooled[0].point.position.isApprox(on_circle(7, 8).position, 1e-4F));
  EXPECT_TRUE(pooled[7].point.position.isApprox(on_circle(0, 8).position, 1e-4F));
}

/// 30 points of a circle; point i is seen from the views up to 3 i.
std::vector<PooledContour> circle() {
  std::vector<PooledContour> contours;
  for (int i = 0; i < 30; ++i) {
    PooledContour c{on_circle(i, 30), ViewMask(2, 0)};
    for (int k = 0; k <= 3 * i; ++k) c.views[k / 64] |= std::uint64_t{1} << (k % 64);
    contours.push_back(c);
  }
  return contours;
}

TEST(SelectContourPairs, TakesCoplanarPairsOfTheRightLengthOncePerPoint) {
  const std::vector<PooledContour> contours = circle();
  const RatedContourPairs rated = select_contour_pairs(contours, kRimDiameter, 10'000, kViews, {});
  ASSERT_EQ(rated.weights.size(), rated.pairs.size());
  std::size_t expected = 0;
  for (std::size_t a = 0; a < 30; ++a) {
    for (std::size_t b = a + 1; b < 30; ++b) {
      const double share = (contours[a].point.position - contours[b].point.position).norm() / kRimDiameter;
      expected += static_cast<std::size_t>(share >= kShortestContourPair && share <= kLongestContourPair);
    }
  }
  EXPECT_EQ(rated.pairs.size(), expected);
  for (const ContourPair& pair : rated.pairs) {
    const double share = (contours[pair.a].point.position - contours[pair.b].point.position).norm() / kRimDiameter;
    EXPECT_GE(share, kShortestContourPair);
    EXPECT_LE(share, kLongestContourPair);
  }
}

TEST(SelectContourPairs, RanksBySharedViewsOverTheRootOfFrequency) {
  // On a circle the weight, 1 / sqrt(frequency), tells the frequency; the masks tell the shared views.
  const std::vector<PooledContour> contours = circle();
  const RatedContourPairs all = select_contour_pairs(contours, kRimDiameter, 10'000, kViews, {});
  double before = 1e9;
  for (std::size_t i = 0; i < all.pairs.size(); ++i) {
    int shared = 0;
    for (int k = 0; k < kViews; ++k) {
      shared += static_cast<int>(sees(contours[all.pairs[i].a].views, k) && sees(contours[all.pairs[i].b].views, k));
    }
    const double value = shared * static_cast<double>(all.weights[i]);
    EXPECT_LE(value, before * (1 + 1e-6)) << i;
    before = value;
  }
  const RatedContourPairs few = select_contour_pairs(contours, kRimDiameter, 20, kViews, {});
  ASSERT_EQ(few.pairs.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(few.pairs[i].a, all.pairs[i].a);
    EXPECT_EQ(few.pairs[i].b, all.pairs[i].b);
  }
}

TEST(SelectContourPairs, LetsNoPointTakePartInMoreThan40) {
  std::vector<PooledContour> contours;
  contours.reserve(200);
  for (int i = 0; i < 200; ++i) contours.push_back({on_circle(i, 200), ViewMask(2, ~std::uint64_t{0})});
  std::map<int, int> used;
  for (const ContourPair& pair : select_contour_pairs(contours, kRimDiameter, 100'000, 128, {}).pairs) {
    ++used[pair.a];
    ++used[pair.b];
  }
  EXPECT_EQ(used.size(), 200u);
  for (const auto& [point, count] : used) EXPECT_LE(count, 40) << point;
}

TEST(SelectContourPairs, TakesNoneThatNoViewShowsWhole) {
  std::vector<PooledContour> contours = circle();
  for (std::size_t i = 0; i < contours.size(); ++i) contours[i].views = {std::uint64_t{1} << i, 0};
  EXPECT_TRUE(select_contour_pairs(contours, kRimDiameter, 100, kViews, {}).pairs.empty());
}

}  // namespace
}  // namespace binpose

#include "core/train/outlines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/view_sphere.h"
#include "core/train/sample_surface.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

constexpr double kPixelSize = 0.002;

std::vector<std::vector<ContourPoint>> outlines_of(const Mesh& mesh, const std::vector<Vector3f>& views, int threads) {
  RunControl control;
  control.threads = threads;
  return outlines(scatter(mesh, kPixelSize / 2), views, 0.14, kPixelSize, 0.004, control);
}

TEST(Outlines, OfABoxFromAboveAreTheRimOfItsTop) {
  const std::vector<ContourPoint> rim = outlines_of(testing::box({0.1F, 0.06F, 0.03F}), {{0, 0, 1}}, 1)[0];
  for (const ContourPoint& c : rim) {
    EXPECT_NEAR(c.position.z(), 0.015F, 1e-5F);
    EXPECT_TRUE(c.normal.isApprox(Vector3f(0, 0, 1), 1e-4F));
    const float to_x = 0.05F - std::abs(c.position.x()), to_y = 0.03F - std::abs(c.position.y());
    EXPECT_LT(std::min(to_x, to_y), 2 * kPixelSize);
    if (std::max(to_x, to_y) > 3 * kPixelSize) {
      const Vector3f away = to_x < to_y ? Vector3f(std::copysign(1.0F, c.position.x()), 0, 0)
                                        : Vector3f(0, std::copysign(1.0F, c.position.y()), 0);
      EXPECT_GT(c.outward.dot(away), 0.9F);
    }
  }
  EXPECT_NEAR(static_cast<double>(rim.size()), 0.32 / kPixelSize, 0.15 * 0.32 / kPixelSize);
}

TEST(Outlines, OfAStepAreInsideOfTheSilhouetteToo) {
  const Mesh hat = testing::joined(testing::box({0.1F, 0.1F, 0.02F}),
                                   testing::shifted(testing::box({0.04F, 0.04F, 0.02F}), {0, 0, 0.02F}));
  const std::vector<ContourPoint> rims = outlines_of(hat, {{0, 0, 1}}, 1)[0];
  const auto upper =
      std::count_if(rims.begin(), rims.end(), [](const ContourPoint& c) { return c.position.z() > 0.02F; });
  EXPECT_NEAR(static_cast<double>(upper), 0.16 / kPixelSize, 0.2 * 0.16 / kPixelSize);
  EXPECT_GT(rims.size() - static_cast<std::size_t>(upper), 150u);
}

TEST(Outlines, ShowNothingOfTheBackThroughGapsBetweenPoints) {
  const std::vector<SurfacePoint> dense = scatter(testing::pinned_disc(), 0.75 * kPixelSize);  // some pixels stay empty
  const std::vector<Vector3f> below = {{0, 0, -1}};                                            // the plain side
  const std::vector<ContourPoint> rim = outlines(dense, below, 0.06, kPixelSize, 0.004, {})[0];
  EXPECT_GT(rim.size(), 60U);
  for (const ContourPoint& c : rim) EXPECT_GT(c.position.head<2>().norm(), 0.03 - 3 * kPixelSize);
}

TEST(Outlines, LieOnTheSideThatTheViewerSees) {
  const std::vector<Vector3f> views = view_directions(40);
  const auto of_views = outlines_of(testing::l_block(), views, 1);
  ASSERT_EQ(of_views.size(), 40u);
  for (int k = 0; k < 40; ++k) {
    EXPECT_GT(of_views[k].size(), 30u) << k;
    for (const ContourPoint& c : of_views[k]) {
      EXPECT_GT(c.normal.dot(views[k]), 0.17F);
      EXPECT_NEAR(c.outward.dot(views[k]), 0, 0.03F) << "across the view";
    }
  }
}

TEST(Outlines, AreTheSameOnAnyNumberOfThreads) {
  const std::vector<Vector3f> views = view_directions(20);
  const auto one = outlines_of(testing::l_block(), views, 1);
  for (const int threads : {2, 4}) {
    const auto many = outlines_of(testing::l_block(), views, threads);
    for (int k = 0; k < 20; ++k) {
      ASSERT_EQ(many[k].size(), one[k].size());
      for (std::size_t i = 0; i < one[k].size(); ++i) ASSERT_EQ(many[k][i].position, one[k][i].position);
    }
  }
}

}  // namespace
}  // namespace binpose

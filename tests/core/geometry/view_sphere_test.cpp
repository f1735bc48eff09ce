#include "core/geometry/view_sphere.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/scenes/random.h"

namespace binpose {
namespace {

TEST(ViewSphere, HoldsUnitVectorsAboutEquallyFarApart) {
  const std::vector<Eigen::Vector3f> views = view_directions(500);
  ASSERT_EQ(views.size(), 500u);
  for (std::size_t i = 0; i < views.size(); ++i) {
    EXPECT_NEAR(views[i].norm(), 1, 1e-6);
    float nearest = 2;
    for (std::size_t j = 0; j < views.size(); ++j) {
      if (i != j) nearest = std::min(nearest, (views[i] - views[j]).norm());
    }
    // A square of the sphere's area over the count has a side of 0.159.
    EXPECT_GT(nearest, 0.11F) << i;
    EXPECT_LT(nearest, 0.21F) << i;
  }
}

TEST(ViewSphere, LeavesNoGap) {
  const std::vector<Eigen::Vector3f> views = view_directions(500);
  scenes::Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3f direction = (random.rotation() * Eigen::Vector3d::UnitX()).cast<float>();
    EXPECT_LT((views[nearest_view(views, direction)] - direction).norm(), 0.16F);
  }
}

TEST(ViewSphere, ShowsEachHemisphereEqually) {
  const std::vector<Eigen::Vector3f> views = view_directions(500);
  for (int axis = 0; axis < 3; ++axis) {
    const auto count = std::count_if(views.begin(), views.end(), [&](const Eigen::Vector3f& v) { return v[axis] > 0; });
    EXPECT_NEAR(static_cast<double>(count), 250, 3);
  }
}

TEST(NearestView, HasTheSmallestAngleWhateverTheLength) {
  const std::vector<Eigen::Vector3f> views = view_directions(100);
  for (int k = 0; k < 100; ++k) {
    EXPECT_EQ(nearest_view(views, views[k]), k);
    EXPECT_EQ(nearest_view(views, 1e-3F * views[k]), k);
  }
}

}  // namespace
}  // namespace binpose

#include "core/geometry/cell_index.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace binpose {
namespace {

TEST(CellIndex, FindsWhatComparingAllPointsFinds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return Eigen::Vector3f(uniform(random), uniform(random), uniform(random)); };
  std::vector<SurfacePoint> points(500);
  for (SurfacePoint& point : points) point = {any(), any().normalized()};
  CellIndex index(points, 0.3F);
  index.insert_all();
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const SurfacePoint asked{1.5F * any(), any().normalized()};
    const float distance = i % 2 == 0 ? 0.3F : 0.1F;
    int expected = -1;
    float least = distance * distance;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const float sq_distance = (points[k].position - asked.position).squaredNorm();
      if (sq_distance >= least || points[k].normal.dot(asked.normal) <= 0.5F) continue;
      expected = static_cast<int>(k);
      least = sq_distance;
    }
    ASSERT_EQ(index.nearest(asked, distance), expected);
    ASSERT_EQ(index.near(asked, distance), expected >= 0);
    found += static_cast<int>(expected >= 0);
  }
  EXPECT_GT(found, 200);
}

TEST(CellIndex, FindsOnlyWhatWasInserted) {
  const std::vector<SurfacePoint> points(2, {{0, 0, 0}, {0, 0, 1}});
  CellIndex index(points, 1);
  EXPECT_FALSE(index.near(points[0], 1));
  index.insert(1);
  EXPECT_EQ(index.nearest(points[0], 1), 1);
}

}  // namespace
}  // namespace binpose

#include "core/train/visibility.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/params.h"
#include "core/train/sample_surface.h"
#include "tests/support/ray_cast.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

const double kCos80 = std::cos(80 * kDegree);

/// A cube of 100 mm; points at the middle of its sides, not of its faces, so that nothing is special about them.
struct Cube {
  std::vector<SurfacePoint> dense = scatter(testing::box({0.1F, 0.1F, 0.1F}), 0.0012);
  std::vector<SurfacePoint> points = {{{0.05F, 0.01F, 0.02F}, {1, 0, 0}},
                                      {{0.05F, -0.02F, 0.01F}, {1, 0, 0}},
                                      {{0.01F, 0.05F, 0.02F}, {0, 1, 0}},
                                      {{0.02F, 0.01F, 0.05F}, {0, 0, 1}},
                                      {{-0.05F, 0.02F, 0.01F}, {-1, 0, 0}}};
  static constexpr int kViews = 1000;
  std::vector<Vector3f> views = view_directions(kViews);
  std::vector<ViewMask> masks = visibility(dense, points, views, 0.0036, {});

  double obs(int p, int q1, int q2) const { return observability(masks[p], masks[q1], masks[q2], kViews); }
};

TEST(Observability, OfAPointOnACubeIsTheCapOfViewsWithin80Degrees) {  // Eq. (5)
  const Cube cube;
  for (const ViewMask& mask : cube.masks) EXPECT_NEAR(observability(mask, Cube::kViews), (1 - kCos80) / 2, 0.01);
}

TEST(Observability, OfAPairIsTheShareOfViewsThatSeeAllThree) {  // Eq. (6)
  const Cube cube;
  int two = 0, three = 0;
  const std::vector<Vector3f> fine = view_directions(200'000);
  for (const Vector3f& v : fine) {
    two += static_cast<int>(v.head<2>().minCoeff() >= kCos80);
    three += static_cast<int>(v.minCoeff() >= kCos80);
  }
  EXPECT_NEAR(cube.obs(0, 1, 1), (1 - kCos80) / 2, 0.01) << "one face";
  EXPECT_NEAR(cube.obs(0, 1, 2), two / 200'000.0, 0.01) << "two faces at an edge";
  EXPECT_NEAR(cube.obs(0, 2, 3), three / 200'000.0, 0.01) << "three faces at a corner";
  EXPECT_EQ(cube.obs(0, 1, 4), 0) << "opposite faces";
}

TEST(Observability, CountsBits) {
  ViewMask p(2, 0), q1(2, 0), q2(2, 0);
  for (const int k : {0, 5, 63, 64, 99}) p[k / 64] |= std::uint64_t{1} << (k % 64);
  for (const int k : {5, 63, 64, 98}) q1[k / 64] |= std::uint64_t{1} << (k % 64);
  for (const int k : {0, 5, 64, 98}) q2[k / 64] |= std::uint64_t{1} << (k % 64);
  EXPECT_DOUBLE_EQ(observability(p, 100), 0.05);
  EXPECT_DOUBLE_EQ(observability(p, q1, q2, 100), 0.02);
}

/// Whether a ray from the point to the far viewer is free.
bool ray_is_free(const testing::PlacedMesh& body, const SurfacePoint& point, const Vector3f& view) {
  const Eigen::Vector3d start = (point.position + 1e-5F * point.normal).cast<double>();
  return !testing::cast_ray({&body, 1}, start, view.cast<double>());
}

TEST(Visibility, AgreesWithRayCastingOnAPartThatHidesItself) {
  const testing::PlacedMesh body{testing::l_block()};
  const std::vector<SurfacePoint> dense = scatter(body.mesh, 0.0007);
  const std::vector<SurfacePoint> points = thin_evenly(dense, 0.005);
  const std::vector<Vector3f> views = view_directions(60);
  const std::vector<ViewMask> masks = visibility(dense, points, views, 0.002, {});
  int compared = 0, differ = 0, hidden = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int k = 0; k < 60; ++k) {
      const float cosine = points[i].normal.dot(views[k]);
      if (std::abs(cosine - kCos80) < 1e-4) continue;
      const bool expected = cosine > kCos80 && ray_is_free(body, points[i], views[k]);
      hidden += static_cast<int>(cosine > kCos80 && !expected);
      ++compared;
      differ += static_cast<int>(expected != sees(masks[i], k));
    }
  }
  EXPECT_GT(hidden, 100) << "the legs hide each other";
  // Only at silhouettes, to within a cell, the two may differ.
  EXPECT_LT(differ, 0.02 * compared);
}

TEST(Visibility, IsTheSameOnAnyNumberOfThreads) {
  const Cube cube;
  for (const int threads : {2, 4}) {
    RunControl control;
    control.threads = threads;
    EXPECT_EQ(visibility(cube.dense, cube.points, cube.views, 0.0036, control), cube.masks);
  }
}

/// Points of several bodies, a shell each.
struct Bodies {
  std::vector<SurfacePoint> dense;
  std::vector<std::uint32_t> shell_of;

  void add(const Mesh& mesh, bool turned) {
    for (SurfacePoint point : scatter(mesh, 0.001)) {
      if (turned) point.normal = -point.normal;
      dense.push_back(point);
      shell_of.push_back(count);
    }
    ++count;
  }
  /// Share of the points of a shell that are seen from behind.
  double behind(std::uint32_t shell) const {
    const std::vector<bool> all = seen_from_behind(dense, shell_of, view_directions(60), 0.003);
    int points = 0, turned = 0;
    for (std::size_t i = 0; i < dense.size(); ++i) {
      if (shell_of[i] != shell) continue;
      ++points;
      turned += static_cast<int>(all[i]);
    }
    return static_cast<double>(turned) / points;
  }
  std::uint32_t count = 0;
};

TEST(SeenFromBehind, FindsTheShellsWhoseNormalsPointInwards) {
  Bodies bodies;
  bodies.add(testing::l_block(), false);
  bodies.add(testing::shifted(testing::box({0.03F, 0.03F, 0.03F}), {0.15F, 0, 0}), true);
  bodies.add(testing::shifted(testing::box({0.1F, 0.06F, 0.0005F}), {0, 0, 0.1F}), false);
  bodies.add(testing::shifted(testing::box({0.1F, 0.06F, 0.0005F}), {0, 0, -0.1F}), true);
  for (const std::uint32_t shell : {0, 1, 2, 3}) EXPECT_EQ(bodies.behind(shell), shell % 2) << shell;
}

TEST(SeenFromBehind, LeavesASheetAsItIs) {
  Mesh sheet;
  sheet.vertices = {{0, 0, 0}, {0.1F, 0, 0}, {0.1F, 0.05F, 0}, {0, 0.05F, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const bool turned : {false, true}) {
    Bodies bodies;
    bodies.add(sheet, turned);
    EXPECT_EQ(bodies.behind(0), 0);
  }
}

TEST(SeenFromBehind, JudgesWhatNobodySeesLikeTheWholeMesh) {
  for (const bool turned : {false, true}) {
    Bodies bodies;
    bodies.add(testing::box({0.1F, 0.1F, 0.1F}), turned);
    bodies.add(testing::box({0.05F, 0.05F, 0.05F}), turned);
    EXPECT_EQ(bodies.behind(1), turned);
  }
}

}  // namespace
}  // namespace binpose

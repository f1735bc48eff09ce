#include "core/train/sample_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

bool same_side(const SurfacePoint& a, const SurfacePoint& b) { return a.normal.dot(b.normal) > 0.5F; }

/// Least distance of two points on the same side.
float closest_pair(std::span<const SurfacePoint> points) {
  float closest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      if (same_side(points[i], points[j])) {
        closest = std::min(closest, (points[i].position - points[j].position).norm());
      }
    }
  }
  return closest;
}

/// Greatest distance of a dense point from the nearest kept one of its side.
float widest_gap(std::span<const SurfacePoint> dense, std::span<const SurfacePoint> kept) {
  float widest = 0;
  for (const SurfacePoint& d : dense) {
    float nearest = std::numeric_limits<float>::infinity();
    for (const SurfacePoint& k : kept) {
      if (same_side(d, k)) nearest = std::min(nearest, (d.position - k.position).norm());
    }
    widest = std::max(widest, nearest);
  }
  return widest;
}

TEST(Scatter, PutsPointsOnTheFacesInProportionToTheirArea) {
  const Vector3f size(0.1F, 0.06F, 0.02F);
  const std::vector<SurfacePoint> points = scatter(testing::box(size), 0.001);
  EXPECT_NEAR(static_cast<double>(points.size()), 2 * (100 * 60 + 100 * 20 + 60 * 20), 2);
  double count[3] = {};
  for (const SurfacePoint& p : points) {
    int axis = 0;
    EXPECT_NEAR(p.normal.cwiseAbs().maxCoeff(&axis), 1, 1e-6F);
    EXPECT_NEAR(p.position[axis], p.normal[axis] * size[axis] / 2, 1e-6F) << "on its face";
    EXPECT_TRUE((p.position.array().abs() <= size.array() / 2 + 1e-6F).all());
    ++count[axis];
  }
  EXPECT_NEAR(count[2], 2 * 100 * 60, 4);
  EXPECT_NEAR(count[1], 2 * 100 * 20, 4);
  EXPECT_NEAR(count[0], 2 * 60 * 20, 4);
}

TEST(Scatter, FillsEachTriangleEvenly) {
  Mesh triangle;
  triangle.vertices = {{0, 0, 0}, {0.1F, 0, 0}, {0, 0.1F, 0}};
  triangle.triangles = {{0, 1, 2}};
  const std::vector<SurfacePoint> points = scatter(triangle, 0.001);
  // The four similar triangles between the middles of the sides have equal areas.
  int corner[3] = {}, middle = 0;
  for (const SurfacePoint& p : points) {
    const float x = p.position.x(), y = p.position.y();
    if (x > 0.05F) {
      ++corner[1];
    } else if (y > 0.05F) {
      ++corner[2];
    } else if (x + y < 0.05F) {
      ++corner[0];
    } else {
      ++middle;
    }
  }
  for (const int count : {corner[0], corner[1], corner[2], middle}) EXPECT_NEAR(count, 1250, 25);
}

TEST(Scatter, LeavesNoGapsInAFanOfSlivers) {
  constexpr double kSpacing = 0.0004;
  constexpr float kRadius = 0.03F;
  constexpr int kSlivers = 120;
  Mesh fan;
  fan.vertices.emplace_back(0, 0, 0);
  for (int i = 0; i < kSlivers; ++i) {
    const float angle = static_cast<float>(2 * std::numbers::pi * i / kSlivers);
    fan.vertices.emplace_back(kRadius * std::cos(angle), kRadius * std::sin(angle), 0);
    fan.triangles.push_back({0, 1U + i, 1U + (i + 1) % kSlivers});
  }
  constexpr int kHalf = 35, kCells = 2 * kHalf;  // of three spacings, over the disc's box and beyond
  std::vector<int> count(kCells * kCells);
  const auto cell_of = [](float x) { return static_cast<int>(std::floor(x / (3 * kSpacing))) + kHalf; };
  for (const SurfacePoint& p : scatter(fan, kSpacing)) {
    ++count[cell_of(p.position.y()) * kCells + cell_of(p.position.x())];
  }
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const Eigen::Vector2f middle = Eigen::Vector2i(column - kHalf, row - kHalf).cast<float>().array() + 0.5F;
      if (static_cast<float>(3 * kSpacing) * (middle.norm() + 1) > kRadius) continue;  // not wholly inside
      EXPECT_GE(count[row * kCells + column], 3) << middle.transpose();
      EXPECT_LE(count[row * kCells + column], 17) << middle.transpose();
    }
  }
}

TEST(Scatter, EndsWhereCoordinatesAreTooCoarseToCutATriangle) {
  Mesh far;  // 8 is the step of single precision there
  far.vertices = {{1e8F, 0, 0}, {1e8F + 16, 0, 0}, {1e8F, 1, 0}};
  far.triangles = {{0, 1, 2}};
  const std::size_t count = scatter(far, 0.1).size();
  EXPECT_GE(count, 1U);
  EXPECT_LE(count, 801U);
}

TEST(Scatter, OfManySmallTrianglesKeepsTheDensity) {
  Mesh strip;  // 1000 slivers that are worth a third of a point each
  for (std::uint32_t i = 0; i <= 1000; ++i) {
    strip.vertices.emplace_back(0.0001F * static_cast<float>(i), 0, 0);
    strip.vertices.emplace_back(0.0001F * static_cast<float>(i), 0.01F, 0);
    if (i > 0) strip.triangles.push_back({2 * i - 2, 2 * i, 2 * i - 1});
  }
  const double area = 1000 * 0.5 * 0.0001 * 0.01;
  EXPECT_NEAR(static_cast<double>(scatter(strip, 0.00122).size()), area / (0.00122 * 0.00122), 2);
}

TEST(Scatter, GivesTrianglesWithoutAreaNone) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.1F, 0, 0}, {0.2F, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 0, 0}, {1, 1, 2}};
  EXPECT_TRUE(scatter(mesh, 1e-4).empty());
}

TEST(ThinEvenly, LeavesNoTwoPointsNearAndNoGap) {
  constexpr double kDistance = 0.005;
  for (const Mesh& mesh : {testing::box({0.1F, 0.06F, 0.02F}), testing::l_block(), testing::stepped_shaft()}) {
    const std::vector<SurfacePoint> dense = scatter(mesh, 0.0015);
    const std::vector<SurfacePoint> kept = thin_evenly(dense, kDistance);
    EXPECT_GE(closest_pair(kept), kDistance * (1 - 1e-6));
    EXPECT_LE(widest_gap(dense, kept), kDistance * (1 + 1e-6));
  }
}

TEST(ThinEvenly, IsProgressive) {
  constexpr float kDistance = 0.004F;
  const std::vector<SurfacePoint> dense = scatter(testing::l_block(), 0.0015);
  const std::vector<SurfacePoint> kept = thin_evenly(dense, kDistance);
  for (const std::size_t part : {2, 4, 8, 16}) {
    const std::span<const SurfacePoint> prefix(kept.data(), kept.size() / part);
    // n times fewer points lie about sqrt(n) times farther apart; levels halve the distance, hence the factor 2.
    const float spacing = kDistance * std::sqrt(static_cast<float>(part));
    EXPECT_GE(closest_pair(prefix), 0.5F * spacing) << part;
    EXPECT_LE(widest_gap(dense, prefix), 2.5F * spacing) << part;
  }
}

TEST(ThinEvenly, SpreadsInProportionToArea) {
  const Vector3f size(0.12F, 0.06F, 0.03F);
  const std::vector<SurfacePoint> kept = thin_evenly(scatter(testing::box(size), 0.001), 0.003);
  double count[3] = {};
  for (const SurfacePoint& p : kept) {
    int axis = 0;
    p.normal.cwiseAbs().maxCoeff(&axis);
    ++count[axis];
  }
  const double total = count[0] + count[1] + count[2], area = 0.12 * 0.06 + 0.12 * 0.03 + 0.06 * 0.03;
  EXPECT_NEAR(count[2] / total, 0.12 * 0.06 / area, 0.04);
  EXPECT_NEAR(count[1] / total, 0.12 * 0.03 / area, 0.04);
  EXPECT_NEAR(count[0] / total, 0.06 * 0.03 / area, 0.04);
}

TEST(ThinEvenly, TreatsTheSidesOfASheetEachForItself) {
  const std::vector<SurfacePoint> kept = thin_evenly(scatter(testing::box({0.1F, 0.1F, 0.0005F}), 0.001), 0.01);
  const auto up = std::count_if(kept.begin(), kept.end(), [](const SurfacePoint& p) { return p.normal.z() > 0.5F; });
  const auto down = std::count_if(kept.begin(), kept.end(), [](const SurfacePoint& p) { return p.normal.z() < -0.5F; });
  EXPECT_GT(up, 70);
  EXPECT_GT(down, 70);
}

TEST(ThinEvenly, OfNothingIsNothing) { EXPECT_TRUE(thin_evenly({}, 0.01).empty()); }

}  // namespace
}  // namespace binpose

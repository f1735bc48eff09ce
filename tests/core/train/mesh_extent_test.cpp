#include "core/train/mesh_extent.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/shapes.h"

namespace binpose {
namespace {

using ::testing::HasSubstr;

TEST(MeshExtent, OfABoxIsItsSizeDiagonalAndArea) {
  const MeshExtent extent = mesh_extent(testing::shifted(testing::box({0.03F, 0.04F, 0.12F}), {0.1F, 0.2F, 0.3F}));
  EXPECT_TRUE(extent.box_min.isApprox(Eigen::Vector3d(0.085, 0.18, 0.24), 1e-6));
  EXPECT_TRUE(extent.box_max.isApprox(Eigen::Vector3d(0.115, 0.22, 0.36), 1e-6));
  EXPECT_NEAR(extent.diameter, 0.13, 1e-6);
  EXPECT_NEAR(extent.area, 2 * (0.03 * 0.04 + 0.04 * 0.12 + 0.03 * 0.12), 1e-8);
}

TEST(MeshExtent, DiameterIsThatOfAllPairsOfVertices) {
  for (const Mesh& mesh : {testing::l_block(), testing::hexagon(), testing::stepped_shaft(), testing::sphere(0.07F)}) {
    float expected = 0;
    for (const Eigen::Vector3f& a : mesh.vertices) {
      for (const Eigen::Vector3f& b : mesh.vertices) expected = std::max(expected, (a - b).norm());
    }
    const double diameter = mesh_extent(mesh).diameter;
    EXPECT_LE(diameter, expected * (1 + 1e-6));
    EXPECT_GE(diameter, 0.9985 * expected);
  }
}

TEST(MeshExtent, IgnoresVerticesThatNoTriangleUses) {
  Mesh mesh = testing::box({0.03F, 0.04F, 0.12F});
  mesh.vertices.emplace_back(5, 5, 5);
  EXPECT_NEAR(mesh_extent(mesh).diameter, 0.13, 1e-6);
  EXPECT_NEAR(mesh_extent(mesh).box_max.x(), 0.015, 1e-6);
}

struct RefusedMesh {
  Mesh mesh;
  const char* says;
};

TEST(CheckMesh, RefusesWhatNothingCanBeTrainedFrom) {
  const Mesh good = testing::box({0.03F, 0.04F, 0.12F});
  Mesh empty, bad_index = good, not_finite = good, flat = good;
  bad_index.triangles[3][1] = 99;
  not_finite.vertices[2].y() = std::numeric_limits<float>::quiet_NaN();
  flat.triangles = {{0, 0, 6}, {6, 6, 0}};
  const Mesh speck = testing::box({1e-4F, 1e-4F, 1e-4F});
  const Mesh specks = testing::joined(speck, testing::shifted(speck, {5, 0, 0}));
  Mesh huge = good, tiny = good, far = good, overflowing = good;
  for (Eigen::Vector3f& v : huge.vertices) v *= 1e6F;
  for (Eigen::Vector3f& v : tiny.vertices) v *= 1e-6F;
  for (Eigen::Vector3f& v : far.vertices) v.x() += 1e9F;
  for (Eigen::Vector3f& v : overflowing.vertices) v *= 1e30F;
  Mesh folded = good;
  for (int i = 0; i < 200; ++i) {
    folded.triangles.insert(folded.triangles.end(), good.triangles.begin(), good.triangles.end());
  }
  const RefusedMesh cases[] = {{empty, "0 triangles"},
                               {bad_index, "triangle 3 refers to vertex 99; there are 8"},
                               {not_finite, "vertex 2 has a coordinate that is not a finite number"},
                               {flat, "degenerate"},
                               {specks, "a stray one lies far off"},
                               {huge, "diameter of 130000 m"},
                               {tiny, "Check the unit"},
                               {far, "vertex 0 has a coordinate beyond 1e+08 m"},
                               {overflowing, "Check the unit"},
                               {folded, "doubled faces"}};
  EXPECT_TRUE(check_mesh(good).ok());
  for (const RefusedMesh& refused : cases) {
    const absl::Status status = check_mesh(refused.mesh);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << refused.says;
    EXPECT_THAT(std::string(status.message()), HasSubstr(refused.says));
  }
}

}  // namespace
}  // namespace binpose

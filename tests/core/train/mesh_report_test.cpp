#include "core/train/mesh_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "core/train/mesh_extent.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

MeshReport examined(const Mesh& mesh) { return examine_mesh(mesh, find_shells(mesh), mesh_extent(mesh).diameter); }

std::vector<std::string> warnings_of(const Mesh& mesh) { return mesh_warnings(examined(mesh), 0); }

Mesh turned(Mesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

/// The mesh without the triangles whose corners all lie at this height.
Mesh without_lid(Mesh mesh, float z) {
  std::erase_if(mesh.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t i) { return mesh.vertices[i].z() == z; });
  });
  return mesh;
}

/// A cylinder whose side and lids were meshed apart, in different numbers of segments.
Mesh cylinder_of_faces(float radius, float height) {
  const Eigen::Vector2f side[] = {{radius, -height / 2}, {radius, height / 2}};
  const Eigen::Vector2f lower[] = {{0, -height / 2}, {radius, -height / 2}};
  const Eigen::Vector2f upper[] = {{radius, height / 2}, {0, height / 2}};
  return testing::joined(testing::joined(testing::revolve(side, 64), testing::revolve(lower, 50)),
                         testing::revolve(upper, 37));
}

TEST(MeshReport, SaysNothingOfSoundMeshes) {
  for (const Mesh& mesh : {testing::box({0.08F, 0.05F, 0.03F}), testing::l_block(), testing::hexagon(),
                           testing::stepped_shaft(), testing::sphere(0.05F)}) {
    EXPECT_THAT(warnings_of(mesh), IsEmpty());
  }
}

TEST(MeshReport, FindsTheRimAndPlaceOfAMissingLid) {
  const MeshReport report =
      examined(testing::shifted(without_lid(testing::box({0.1F, 0.06F, 0.04F}), 0.02F), {1, 2, 3}));
  EXPECT_EQ(report.hole_count, 1u);
  EXPECT_NEAR(report.rim_length, 0.32, 0.01);
  EXPECT_TRUE(report.largest_hole.isApprox(Eigen::Vector3d(1, 2, 3.02), 1e-3));
}

TEST(MeshReport, CountsHolesAndPlacesTheLargest) {
  const Mesh tube = without_lid(without_lid(testing::box({0.1F, 0.06F, 0.04F}), 0.02F), -0.02F);
  EXPECT_EQ(examined(tube).hole_count, 2u);
  const Mesh cup = testing::shifted(without_lid(testing::box({0.02F, 0.02F, 0.04F}), 0.02F), {0, 0, 0.1F});
  const MeshReport report = examined(testing::joined(without_lid(testing::box({0.1F, 0.06F, 0.04F}), 0.02F), cup));
  EXPECT_EQ(report.hole_count, 2u);
  EXPECT_NEAR(report.rim_length, 0.40, 0.01);
  EXPECT_NEAR(report.largest_hole.z(), 0.02, 1e-4);
}

TEST(MeshReport, TakesFacesThatWereMeshedApartForJoined) {
  EXPECT_FALSE(find_shells(cylinder_of_faces(0.02F, 0.05F)).rim.empty());
  EXPECT_EQ(examined(cylinder_of_faces(0.02F, 0.05F)).hole_count, 0u);
  EXPECT_THAT(warnings_of(cylinder_of_faces(0.02F, 0.05F)), IsEmpty());
}

TEST(MeshReport, TakesASlitForClosed) {
  Mesh mesh = testing::box({0.1F, 0.06F, 0.04F});
  // A corner of the first triangle a hair off: its sides no longer meet their neighbours.
  mesh.vertices.push_back(mesh.vertices[mesh.triangles[0][0]] + Eigen::Vector3f(0, 1e-5F, 0));
  mesh.triangles[0][0] = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  EXPECT_EQ(find_shells(mesh).rim.size(), 4u);
  EXPECT_EQ(examined(mesh).hole_count, 0u);
}

TEST(MeshReport, CallsASheetOpenUnlessItHasTwoSides) {
  Mesh sheet;
  sheet.vertices = {{0, 0, 0}, {0.1F, 0, 0}, {0.1F, 0.05F, 0}, {0, 0.05F, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(examined(sheet).hole_count, 1u);
  Mesh two_sided = sheet;
  two_sided.triangles.insert(two_sided.triangles.end(), {{2, 1, 0}, {3, 2, 0}});
  EXPECT_THAT(warnings_of(two_sided), IsEmpty());
}

TEST(MeshReport, CountsTrianglesAgainstTheirNeighboursAndTheirArea) {
  Mesh mesh = testing::box({0.1F, 0.1F, 0.1F});
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  const MeshReport report = examined(mesh);
  EXPECT_EQ(report.against_neighbours, 1u);
  EXPECT_NEAR(report.share_against_neighbours, 1.0 / 12, 1e-6);
  EXPECT_FALSE(report.inside_out);
}

TEST(MeshReport, TellsABodyThatIsInsideOutFromOneWithAVoid) {
  EXPECT_FALSE(examined(testing::l_block()).inside_out);
  EXPECT_TRUE(examined(testing::shifted(turned(testing::l_block()), {5, 5, 5})).inside_out);
  const Mesh void_inside = turned(testing::box({0.05F, 0.05F, 0.05F}));
  EXPECT_FALSE(examined(testing::joined(void_inside, testing::box({0.1F, 0.1F, 0.1F}))).inside_out);
}

TEST(MeshReport, CountsTrianglesWithoutAreaAndDuplicates) {
  Mesh mesh = testing::box({0.1F, 0.1F, 0.1F});
  mesh.triangles.push_back(mesh.triangles[5]);
  mesh.triangles.push_back({0, 0, 1});
  mesh.vertices.push_back((mesh.vertices[0] + mesh.vertices[1]) / 2);
  mesh.triangles.push_back({0, 8, 1});
  const MeshReport report = examined(mesh);
  EXPECT_EQ(report.duplicates, 1u);
  EXPECT_EQ(report.without_area, 2u);
}

TEST(MeshReport, WarnsWithFiguresAndAdvice) {
  MeshReport report{.triangle_count = 100};
  EXPECT_THAT(mesh_warnings(report, 0.04), IsEmpty());
  EXPECT_THAT(mesh_warnings(report, 0.35), ElementsAre(AllOf(HasSubstr("35 %"), HasSubstr("outer shape"))));
  report.hole_count = 2;
  report.rim_length = 0.123;
  report.largest_hole = {0.001, 0.02, -0.03};
  EXPECT_THAT(mesh_warnings(report, 0), ElementsAre(AllOf(HasSubstr("2 hole(s) with 123 mm"),
                                                          HasSubstr("(1.0, 20.0, -30.0) mm"), HasSubstr("solid"))));
  report = {.triangle_count = 100, .against_neighbours = 7, .share_against_neighbours = 0.02};
  EXPECT_THAT(mesh_warnings(report, 0), ElementsAre(AllOf(HasSubstr("7 triangles (2 %"), HasSubstr("unify"))));
  report = {.triangle_count = 100, .inside_out = true};
  EXPECT_THAT(mesh_warnings(report, 0), ElementsAre(HasSubstr("inside out")));
  report = {.triangle_count = 100, .without_area = 4, .duplicates = 4};
  EXPECT_THAT(mesh_warnings(report, 0), IsEmpty());
  report = {.triangle_count = 100, .without_area = 9, .duplicates = 8};
  EXPECT_THAT(mesh_warnings(report, 0), ElementsAre(HasSubstr("9 of 100"), HasSubstr("8 of 100")));
}

TEST(MeshReport, OfEndlessRimsInOnePlaceComesToAnEnd) {
  Mesh shreds;
  for (std::uint32_t t = 0; t < 200'000; ++t) {
    const float at = static_cast<float>(t) * 1e-9F;
    shreds.vertices.insert(shreds.vertices.end(), {{at, 0, 0}, {0.1F, at, 0}, {0, 0.1F, at}});
    shreds.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  EXPECT_EQ(find_shells(shreds).rim.size(), 600'000u);
  EXPECT_EQ(examined(shreds).against_neighbours, 0u);
}

}  // namespace
}  // namespace binpose

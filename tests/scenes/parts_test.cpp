// The parts of tests/data are what the scenes and their truth take them for.
#include <gtest/gtest.h>

#include <map>

#include "tests/scenes/bin.h"
#include "tests/support/bin_scene.h"

namespace binpose::scenes {
namespace {

const std::vector<testing::ScenePart>& parts() {
  static const std::vector<testing::ScenePart> parts = testing::read_parts(BINPOSE_TEST_DATA "/parts");
  return parts;
}

TEST(Parts, AreClosedAndWoundOutwards) {
  for (const auto& part : parts()) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double volume = 0;
    for (const auto& t : part.mesh.triangles) {
      for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
      const auto& v = part.mesh.vertices;
      volume += v[t[0]].cast<double>().dot(v[t[1]].cast<double>().cross(v[t[2]].cast<double>())) / 6;
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1) << part.name;
      EXPECT_TRUE(edges.contains({edge.second, edge.first})) << part.name;
    }
    EXPECT_GT(volume, 5e-6) << part.name;
  }
}

TEST(Parts, HaveTheDiameterThatTheirListTells) {
  for (const auto& part : parts()) EXPECT_NEAR(diameter(part.mesh), part.diameter, 1e-6) << part.name;
}

TEST(Parts, TurnedOnesLookTheSameWhenTurned) {
  int turned = 0;
  for (const auto& part : parts()) {
    if (!part.has_axis) continue;
    ++turned;
    for (const Eigen::Vector3f& vertex : part.mesh.vertices) {
      // Every vertex lies on a facetted circle: turned by one facet it lands on another vertex.
      const Eigen::AngleAxisd turn(2 * EIGEN_PI / 64, part.axis_direction);
      const Eigen::Vector3d moved = part.axis_point + turn * (vertex.cast<double>() - part.axis_point);
      double nearest = 1;
      for (const Eigen::Vector3f& other : part.mesh.vertices) {
        nearest = std::min(nearest, (other.cast<double>() - moved).norm());
      }
      ASSERT_LT(nearest, 1e-6) << part.name;
    }
  }
  EXPECT_EQ(turned, 1);
}

}  // namespace
}  // namespace binpose::scenes

#include "core/train/shells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Corners = std::array<std::uint32_t, 3>;
using Edge = std::array<std::uint32_t, 2>;

Corners least_first(Corners t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

bool is_collapsed(const Corners& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

bool runs_along(const Corners& t, const Edge& edge) {
  for (int k = 0; k < 3; ++k) {
    if (t[k] == edge[0] && t[(k + 1) % 3] == edge[1]) return true;
  }
  return false;
}

/// The same by flooding: from each triangle over its edges to all that it reaches.
struct Flooded {
  std::vector<std::uint32_t> first;
  std::vector<bool> turned;
  std::vector<bool> agrees;  // per shell's first triangle
  std::map<Edge, std::vector<std::uint32_t>> triangles_at;
  std::size_t duplicate_count = 0;

  explicit Flooded(const Mesh& mesh)
      : first(mesh.triangles.size()), turned(first.size(), false), agrees(first.size(), true) {
    std::map<Corners, std::uint32_t> known;
    std::map<std::uint32_t, std::uint32_t> original;  // of a repeated triangle
    for (std::uint32_t t = 0; t < first.size(); ++t) {
      first[t] = t;
      if (is_collapsed(mesh.triangles[t])) continue;
      const auto [entry, is_new] = known.try_emplace(least_first(mesh.triangles[t]), t);
      if (!is_new) {
        original[t] = entry->second;
        continue;
      }
      for (int k = 0; k < 3; ++k) {
        const auto [low, high] = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
        triangles_at[{low, high}].push_back(t);
      }
    }
    duplicate_count = original.size();
    for (std::uint32_t t = 0; t < first.size(); ++t) {
      if (first[t] == t) flood(mesh, t);
    }
    for (const auto& [copy, from] : original) {
      first[copy] = first[from];
      turned[copy] = turned[from];
    }
  }

  void flood(const Mesh& mesh, std::uint32_t start) {
    std::vector<std::uint32_t> open = {start};
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      open.pop_back();
      for (const auto& [edge, triangles] : triangles_at) {
        if (triangles.size() != 2 || (triangles[0] != t && triangles[1] != t)) continue;
        const std::uint32_t other = triangles[0] == t ? triangles[1] : triangles[0];
        const bool against = runs_along(mesh.triangles[t], edge) == runs_along(mesh.triangles[other], edge);
        if (first[other] == start) {
          if (turned[other] != (turned[t] != against)) agrees[start] = false;
          continue;
        }
        first[other] = start;
        turned[other] = turned[t] != against;
        open.push_back(other);
      }
    }
  }
};

Mesh random_mesh(std::mt19937& random, std::uint32_t vertices, int triangles) {
  Mesh mesh;
  mesh.vertices.assign(vertices, Eigen::Vector3f::Zero());
  const auto vertex = [&] { return static_cast<std::uint32_t>(random() % vertices); };
  for (int t = 0; t < triangles; ++t) mesh.triangles.push_back({vertex(), vertex(), vertex()});
  return mesh;
}

TEST(Shells, AreThoseThatFloodingOverEdgesOfTwoTrianglesFinds) {
  std::mt19937 random(1);
  int large = 0;
  for (int round = 0; round < 300; ++round) {
    const Mesh mesh = random_mesh(random, 4 + random() % 8, 2 + static_cast<int>(random() % 20));
    const Shells found = find_shells(mesh);
    const Flooded expected(mesh);
    ASSERT_EQ(found.first, expected.first);
    ASSERT_EQ(found.duplicate_count, expected.duplicate_count);
    for (std::size_t t = 0; t < found.first.size(); ++t) {
      large += static_cast<int>(found.first[t] + 2 < t);
      if (expected.agrees[found.first[t]]) {
        ASSERT_EQ(found.turned[t], expected.turned[t]);
      }
    }
    std::set<Edge> rim, expected_rim;
    for (const Edge& edge : found.rim) rim.insert({std::min(edge[0], edge[1]), std::max(edge[0], edge[1])});
    for (const auto& [edge, triangles] : expected.triangles_at) {
      if (triangles.size() == 1) expected_rim.insert(edge);
    }
    ASSERT_EQ(rim, expected_rim);
  }
  EXPECT_GT(large, 300) << "the meshes must hang together";
}

TEST(Shells, OfTwoBodiesAreTwoWithoutRim) {
  const Mesh mesh = testing::joined(testing::l_block(), testing::hexagon());
  const Shells shells = find_shells(mesh);
  EXPECT_EQ(std::set(shells.first.begin(), shells.first.end()).size(), 2u);
  EXPECT_EQ(std::count(shells.turned.begin(), shells.turned.end(), true), 0);
  EXPECT_TRUE(shells.rim.empty());
}

TEST(Shells, TellWhichTrianglesAreTurned) {
  Mesh mesh = testing::hexagon();
  for (const int t : {3, 4, 17}) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const Shells shells = find_shells(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) EXPECT_EQ(shells.turned[t], t == 3 || t == 4 || t == 17) << t;
}

TEST(Shells, RimRunsAsTheShellIsWound) {
  Mesh mesh;
  mesh.vertices.assign(4, Eigen::Vector3f::Zero());
  mesh.triangles = {{0, 1, 2}, {2, 0, 3}};  // the second is turned
  const Shells shells = find_shells(mesh);
  const std::set<Edge> rim(shells.rim.begin(), shells.rim.end());
  EXPECT_EQ(rim, (std::set<Edge>{{0, 1}, {1, 2}, {2, 3}, {3, 0}}));
}

TEST(Shells, AreFoundInTheLargestMeshesOfTheWorstKind) {
  constexpr std::uint32_t kCount = 2'000'000;
  Mesh collapsed, repeated, fan;
  collapsed.vertices.assign(kCount + 2, Eigen::Vector3f::Zero());
  repeated.vertices = fan.vertices = collapsed.vertices;
  collapsed.triangles.assign(kCount, {7, 7, 7});
  repeated.triangles.assign(kCount, {3, 2, 1});
  for (std::uint32_t t = 0; t < kCount; ++t) fan.triangles.push_back({0, t + 1, t + 2});
  EXPECT_TRUE(find_shells(collapsed).rim.empty());
  EXPECT_EQ(find_shells(repeated).duplicate_count, kCount - 1);
  const Shells of_fan = find_shells(fan);
  EXPECT_EQ(of_fan.rim.size(), kCount + 2);
  EXPECT_EQ(of_fan.first[kCount - 1], 0u);
}

TEST(Shells, SearchEndsWhenStopped) {
  std::stop_source stop;
  stop.request_stop();
  RunControl control;
  control.stop = stop.get_token();
  EXPECT_TRUE(find_shells(testing::l_block(), control).rim.empty());
}

}  // namespace
}  // namespace binpose

#include "tests/scenes/convex_pieces.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "tests/scenes/box_mesh.h"

namespace binpose::scenes {
namespace {

using Box = Eigen::AlignedBox3d;

/// An angle profile: 40 mm by 40 mm, 10 mm thick, 20 mm long.
Mesh angle_profile() {
  Mesh mesh;
  for (const float z : {0.F, 0.02F}) {
    for (const auto& [x, y] :
         {std::pair(0.F, 0.F), {0.04F, 0.F}, {0.04F, 0.01F}, {0.01F, 0.01F}, {0.01F, 0.04F}, {0.F, 0.04F}}) {
      mesh.vertices.emplace_back(x, y, z);
    }
  }
  for (std::uint32_t i = 1; i < 5; ++i) {
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({6, 6 + i, 7 + i});
  }
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t j = (i + 1) % 6;
    mesh.triangles.push_back({i, j, 6 + i});
    mesh.triangles.push_back({j, 6 + j, 6 + i});
  }
  return mesh;
}

Box bounds(const ConvexPiece& piece) {
  Box box;
  for (const auto& corner : piece) box.extend(corner);
  return box;
}

TEST(ConvexPieces, LeaveAConvexPartWhole) {
  const Mesh box = box_mesh(Box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.03, 0.02, 0.01)));
  const std::vector<ConvexPiece> pieces = convex_pieces(box, 0.0001);
  ASSERT_EQ(pieces.size(), 1);
  EXPECT_EQ(pieces[0].size(), 8);
}

TEST(ConvexPieces, CutAnAngleProfileIntoItsTwoLegs) {
  const std::vector<ConvexPiece> pieces = convex_pieces(angle_profile(), 0.0005);
  ASSERT_EQ(pieces.size(), 2);
  const Box a = bounds(pieces[0]), b = bounds(pieces[1]);
  EXPECT_NEAR(a.volume() + b.volume(), (0.04 * 0.01 + 0.03 * 0.01) * 0.02, 1e-9);
  EXPECT_NEAR(a.intersection(b).volume(), 0, 1e-12);
}

TEST(ConvexPieces, MayBridgeWhatTheToleranceAllows) { EXPECT_EQ(convex_pieces(angle_profile(), 0.05).size(), 1); }

}  // namespace
}  // namespace binpose::scenes

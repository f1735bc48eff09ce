#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "core/geometry/mesh.h"

namespace binpose::scenes {

/// Adds a closed box to a mesh.
inline void add_box(Mesh& mesh, const Eigen::AlignedBox3d& box) {
  using Triangle = std::array<std::uint32_t, 3>;
  constexpr std::array<Triangle, 12> kFaces{Triangle{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                            {2, 6, 3},         {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 8; ++i) {  // bit 0 = x, bit 1 = y, bit 2 = z
    mesh.vertices.emplace_back(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)).cast<float>());
  }
  for (const Triangle& face : kFaces) mesh.triangles.push_back({base + face[0], base + face[1], base + face[2]});
}

inline Mesh box_mesh(const Eigen::AlignedBox3d& box) {
  Mesh mesh;
  add_box(mesh, box);
  return mesh;
}

}  // namespace binpose::scenes

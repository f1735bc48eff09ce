#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace binpose {

/// Triangle mesh in the model frame, metres. Triangles index into `vertices`, counter-clockwise seen from outside;
/// where a file winds them otherwise, training turns them.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace binpose

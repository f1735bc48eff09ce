#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/run_control.h"

namespace binpose {

/// Joins things into sets; each remembers whether it is turned against the first of its set.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count);

  struct Member {
    std::uint32_t first;  ///< least index of the set
    bool turned;          ///< against that one
  };
  Member find(std::uint32_t index);
  /// Without effect when both are of one set already.
  void join(std::uint32_t a, std::uint32_t b, bool turned);

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<bool> turned_;  // against the parent
};

/// How the triangles of a mesh hang together.
struct Shells {
  std::vector<std::uint32_t> first;  ///< per triangle: the first one of its shell, all that is joined over shared edges
  std::vector<bool> turned;          ///< per triangle: wound against that one
  std::vector<std::array<std::uint32_t, 2>> rim;  ///< edges of a single triangle, as the first of the shell is wound
  std::size_t duplicate_count = 0;                ///< triangles that repeat another one
};

/// Finds the shells of a mesh whose equal vertices are merged, as read_mesh() does. Surfaces that touch along an edge
/// of more than two triangles stay apart; in a one-sided strip some neighbours stay turned against each other.
///
/// @return  of no use when `control` interrupts.
/// Cost: linear in triangles and vertices, below 20 ms for 100 000 triangles; some 40 bytes each besides.
Shells find_shells(const Mesh& mesh, const RunControl& control = {});

}  // namespace binpose

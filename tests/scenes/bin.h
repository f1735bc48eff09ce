#pragma once

#include "core/geometry/mesh.h"

namespace binpose::scenes {

/// An open box, metres. Its frame: origin in the middle of the floor, x along the length, z up.
struct Bin {
  double length = 0;  ///< inside
  double width = 0;   ///< inside
  double height = 0;  ///< of the walls above the floor
  double wall = 0.003;
};

/// A bin, 4 to 3 in plan, in which `count` such parts lie about `layers` deep.
Bin bin_for(const Mesh& part, int count, double layers);

/// Floor and walls, closed.
Mesh bin_mesh(const Bin& bin);

/// Largest distance between two vertices.
double diameter(const Mesh& mesh);

}  // namespace binpose::scenes

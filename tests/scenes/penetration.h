#pragma once

#include <vector>

#include "core/geometry/mesh.h"
#include "core/geometry/pose.h"
#include "tests/scenes/bin.h"

namespace binpose::scenes {

/// How deep parts reach into each other at most, metres: points all over each surface (1 mm apart) are looked up in
/// the other solids by rays, knowing nothing of the physics that placed them.
double deepest_penetration(const Mesh& part, const std::vector<Pose>& T_bin_models);

/// How far any part reaches through the floor or, below the rim, through a wall, metres; 0 where none does.
double deepest_outside(const Mesh& part, const std::vector<Pose>& T_bin_models, const Bin& bin);

}  // namespace binpose::scenes

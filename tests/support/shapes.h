#pragma once

#include <Eigen/Core>
#include <span>

#include "core/geometry/mesh.h"

/// Parts made in code: closed meshes in metres, counter-clockwise seen from outside.
namespace binpose::testing {

/// A box around the origin.
Mesh box(const Eigen::Vector3f& size);

/// A prism over a flat outline, from z = -height / 2 to height / 2.
///
/// @param outline  counter-clockwise; straight lines from its first corner to all others stay inside.
Mesh extrude(std::span<const Eigen::Vector2f> outline, float height);

/// A body of revolution about z.
///
/// @param profile  (radius, z) from the bottom to the top; begins and ends with radius 0.
Mesh revolve(std::span<const Eigen::Vector2f> profile, int segments);

/// An L of unequal legs, 80 x 50 mm and 25 mm thick: no turn but the identity maps it onto itself.
Mesh l_block();

/// A hexagon of 24 mm a side, 12 mm thick: 12 turns map it onto itself.
Mesh hexagon();

/// The hexagon with a small block on one face, which makes its turns unequal.
Mesh marked_hexagon();

/// A disc of 60 mm, 10 mm thick, with a small block on one face: nearly a body of revolution about z.
Mesh pinned_disc();

/// A shaft of 90 mm with a thin and a thick end: symmetric about z.
Mesh stepped_shaft();

/// A sphere in 48 segments.
Mesh sphere(float radius);

/// The second mesh added to the first, as it is.
Mesh joined(Mesh first, const Mesh& second);

/// The mesh shifted by `offset`.
Mesh shifted(Mesh mesh, const Eigen::Vector3f& offset);

}  // namespace binpose::testing

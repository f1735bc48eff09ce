#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/mesh.h"

namespace binpose::scenes {

/// Corners of a convex polyhedron.
using ConvexPiece = std::vector<Eigen::Vector3d>;

/// Cuts a closed mesh into convex pieces that together cover it, for a physics engine that knows convex bodies only.
///
/// Boxes are halved until the hull of what lies in each stands nowhere more than `tolerance` (metres) proud of the
/// surface, so bodies that keep their pieces apart never interpenetrate, and touch to within that tolerance.
std::vector<ConvexPiece> convex_pieces(const Mesh& mesh, double tolerance);

}  // namespace binpose::scenes

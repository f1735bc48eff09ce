#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/mesh.h"
#include "core/geometry/pose.h"
#include "tests/scenes/bin.h"
#include "tests/scenes/convex_pieces.h"
#include "tests/scenes/random.h"

namespace binpose::scenes {

/// Lets parts fall into the bin from random places in random attitudes, until they lie still.
///
/// @param part    closed; gives the centre of mass and the inertia.
/// @param pieces  the part cut convex; these collide.
/// @return        T_bin_model of every part that came to rest in the bin; those that rolled over the rim are left out.
/// Errors: DEADLINE_EXCEEDED where the pile still moves after ten simulated seconds.
absl::StatusOr<std::vector<Pose>> drop_parts(const Mesh& part, const std::vector<ConvexPiece>& pieces, const Bin& bin,
                                             int count, Random random);

}  // namespace binpose::scenes

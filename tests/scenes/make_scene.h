#pragma once

#include "absl/status/statusor.h"
#include "tests/scenes/convex_pieces.h"
#include "tests/scenes/scene_files.h"

namespace binpose::scenes {

/// What a scene is made of.
struct SceneParams {
  int count = 20;       ///< parts dropped; 0 = the bin stays empty, as large as for 20
  double layers = 0.9;  ///< how deep they would lie, were they spread evenly
  Scanner scanner;
};

/// Drops parts into a bin and scans it: the same seed gives the same scene, bit for bit.
///
/// @param pieces  the part cut convex, see convex_pieces().
/// Errors: INTERNAL where five drops in a row do not settle or leave parts reaching into each other by 0.2 mm.
absl::StatusOr<Scene> make_scene(const std::string& name, const Mesh& part, const std::vector<ConvexPiece>& pieces,
                                 const SceneParams& params, std::uint64_t seed);

}  // namespace binpose::scenes

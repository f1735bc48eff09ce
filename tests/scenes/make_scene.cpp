#include "tests/scenes/make_scene.h"

#include "tests/scenes/drop.h"
#include "tests/scenes/penetration.h"

namespace binpose::scenes {
namespace {

constexpr int kAttempts = 5;
constexpr double kPenetrationLimit = 0.0002;  // metres

absl::StatusOr<std::vector<Pose>> sound_pile(const Mesh& part, const std::vector<ConvexPiece>& pieces, const Bin& bin,
                                             int count, const Random& random) {
  if (count == 0) return std::vector<Pose>();
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    absl::StatusOr<std::vector<Pose>> T_bin_models = drop_parts(part, pieces, bin, count, random.fork(attempt));
    if (T_bin_models.ok() && deepest_penetration(part, *T_bin_models) < kPenetrationLimit &&
        deepest_outside(part, *T_bin_models, bin) < kPenetrationLimit) {
      return T_bin_models;
    }
  }
  return absl::InternalError("no drop settled without parts reaching into each other");
}

}  // namespace

absl::StatusOr<Scene> make_scene(const std::string& name, const Mesh& part, const std::vector<ConvexPiece>& pieces,
                                 const SceneParams& params, std::uint64_t seed) {
  constexpr int kCountOfEmptyBin = 20;
  const Random random(seed);
  const Bin bin = bin_for(part, params.count > 0 ? params.count : kCountOfEmptyBin, params.layers);
  absl::StatusOr<std::vector<Pose>> T_bin_models = sound_pile(part, pieces, bin, params.count, random.fork(0));
  if (!T_bin_models.ok()) return T_bin_models.status();
  return Scene{name, seed, bin, params.scanner, scan_bin(part, *T_bin_models, bin, params.scanner, random.fork(1))};
}

}  // namespace binpose::scenes

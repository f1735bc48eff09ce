#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "absl/status/status.h"
#include "tests/scenes/bin.h"
#include "tests/scenes/scan.h"

namespace binpose::scenes {

/// All that is written of a scene.
struct Scene {
  std::string part;
  std::uint64_t seed = 0;
  Bin bin;
  Scanner scanner;
  Scan scan;
};

/// Writes depth.png (16 bit), camera.json and gt.json into a folder, made if need be, and scene.ply on demand;
/// README.md tells their fields. Errors: UNAVAILABLE, naming the file that could not be written.
absl::Status write_scene(const Scene& scene, const std::filesystem::path& folder, bool with_ply);

}  // namespace binpose::scenes

// binpose-make-scene: drops parts into a bin and scans them. README.md beside this file tells what comes out.
#include <CLI/CLI.hpp>
#include <chrono>
#include <fstream>
#include <iostream>
#include <sstream>

#include "core/io/read_mesh.h"
#include "tests/scenes/make_scene.h"

namespace binpose::scenes {
namespace {

struct Options {
  std::filesystem::path mesh;
  std::filesystem::path output;
  std::uint64_t seed = 1;
  bool ply = false;
  SceneParams params;
};

absl::Status run(const Options& options) {
  std::ifstream file(options.mesh, std::ios::binary);
  std::stringstream bytes;
  bytes << file.rdbuf();
  const absl::StatusOr<Mesh> part = read_mesh(bytes.str(), MeshFormat::kDetect, 0.001);
  if (!part.ok()) return part.status();

  const auto start = std::chrono::steady_clock::now();
  const std::vector<ConvexPiece> pieces = convex_pieces(*part, 0.02 * diameter(*part));
  const absl::StatusOr<Scene> scene =
      make_scene(options.mesh.stem().string(), *part, pieces, options.params, options.seed);
  if (!scene.ok()) return scene.status();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::cout << options.output.string() << ": " << scene->scan.instances.size() << " parts of " << pieces.size()
            << " convex pieces, " << scene->scan.cloud.width << " x " << scene->scan.cloud.height << " pixels, "
            << took.count() << " s\n";
  return write_scene(*scene, options.output, options.ply);
}

}  // namespace
}  // namespace binpose::scenes

int main(int argc, char** argv) {
  binpose::scenes::Options options;
  binpose::scenes::Scanner& scanner = options.params.scanner;
  CLI::App app("Drops parts into a bin, scans them and writes scan and truth.");
  app.add_option("mesh", options.mesh, "the part, in millimetres")->required()->check(CLI::ExistingFile);
  app.add_option("output", options.output, "folder for the scene")->required();
  app.add_option("--seed", options.seed, "the same seed gives the same scene")->capture_default_str();
  app.add_option("--count", options.params.count, "parts dropped; 0 = an empty bin")
      ->check(CLI::Range(0, 500))
      ->capture_default_str();
  app.add_option("--layers", options.params.layers, "how deep the parts lie, on average")
      ->check(CLI::Range(0.1, 5.0))
      ->capture_default_str();
  double spacing_mm = scanner.point_spacing * 1000, noise_mm = scanner.noise * 1000;
  app.add_option("--spacing-mm", spacing_mm, "between points on the floor")
      ->check(CLI::Range(0.1, 20.0))
      ->capture_default_str();
  app.add_option("--noise-mm", noise_mm, "standard deviation along the ray")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  app.add_flag("--ply", options.ply, "write scene.ply, too");
  CLI11_PARSE(app, argc, argv);
  scanner.point_spacing = spacing_mm / 1000;
  scanner.noise = noise_mm / 1000;

  const absl::Status status = binpose::scenes::run(options);
  if (status.ok()) return 0;
  std::cerr << "binpose-make-scene: " << status.message() << "\n";
  return 1;
}

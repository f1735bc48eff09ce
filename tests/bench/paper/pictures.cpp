#include <set>

#include "core/train/visibility.h"
#include "tests/bench/paper/over_scenes.h"
#include "tests/bench/paper/runs.h"
#include "tests/bench/paper/vector_pairs.h"

namespace binpose::paper {
namespace {

Json numbers(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

/// Surface points with normal and observability.
Json surface(const Model& model) {
  Json points = Json::array();
  for (std::size_t i = 0; i < model.surface.size(); ++i) {
    points.push_back({{"position", numbers(model.surface[i].position)},
                      {"normal", numbers(model.surface[i].normal)},
                      {"observability", observability(model.visibility[i], model.params.viewpoint_count)}});
  }
  return points;
}

/// P, Q1 and Q2 of the pairs that each selection of the paper picks.
Json selected_pairs(const testing::ScenePart& part) {
  Json by_selection;
  for (const auto& [name, selection] : selections()) {
    TrainParams params = TrainParams::paper();
    params.selection = selection;
    const Model model = train_model(part, params);
    Json& pairs = by_selection[name] = Json::array();
    for (const VectorPair& pair : model.pairs) {
      pairs.push_back({numbers(model.pair_points[pair.p].position), numbers(model.pair_points[pair.q1].position),
                       numbers(model.pair_points[pair.q2].position)});
    }
  }
  return by_selection;
}

/// The poses that the default finds in a scene, with what the truth says of each: 1 right, 0 hidden by half, -1 wrong.
Json recognised(const Model& model, const testing::ScenePart& part, const std::filesystem::path& folder) {
  const testing::BinScene scene = testing::read_scene(folder);
  const std::vector<PoseHypothesis> poses = finder(model, {})(scene.cloud);
  std::vector<int> verdicts;
  testing::PoseJudge(part).score(poses, scene.instances, &verdicts);
  Json found = Json::array();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Json rows = Json::array();
    for (int row = 0; row < 4; ++row) {
      const Eigen::RowVector4d r = poses[i].T_scene_model.matrix().row(row);
      rows.push_back({r[0], r[1], r[2], r[3]});
    }
    found.push_back({{"T_scene_model", rows}, {"verdict", verdicts[i]}});
  }
  return found;
}

}  // namespace

void write_pictures(const std::filesystem::path& parts, const std::filesystem::path& scenes,
                    const std::filesystem::path& output) {
  RunLog log(output);
  const std::vector<std::filesystem::path> folders = scene_folders(scenes);
  for (const testing::ScenePart& part : testing::read_parts(parts)) {
    const auto folder = std::find_if(folders.begin(), folders.end(), [&](const std::filesystem::path& candidate) {
      return candidate.filename().string().starts_with(part.name + "_");
    });
    if (log.has(part.name) || folder == folders.end()) continue;
    const Model model = train_model(part, {});
    log.add(part.name, {{"scene", folder->filename()},
                        {"surface", surface(model)},
                        {"pairs", selected_pairs(part)},
                        {"recognised", recognised(model, part, *folder)}});
    show_progress("pictures", 1, 1, part.name);
  }
}

}  // namespace binpose::paper

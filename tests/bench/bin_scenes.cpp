/// Whole scenes: trains the parts of a folder, searches each scene for its part, and compares with the truth.
///
///   binpose-bench-scenes PARTS SCENES [--filter TEXT] [--ply] [--threads N] ...
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/detect/detect.h"
#include "core/train/train.h"
#include "tests/support/bin_scene.h"
#include "tests/support/median.h"
#include "tests/support/scene_score.h"

namespace {

using namespace binpose;           // NOLINT
using namespace binpose::testing;  // NOLINT

/// The same scan by a worse sensor: noise along the ray, and only a share of the points.
void degrade(PointCloud& cloud, double noise, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> error(0, noise);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (Eigen::Vector3f& p : cloud.points) {
    if (noise > 0) p += p.normalized() * static_cast<float>(error(random));
    if (share < 1 && uniform(random) >= share) p.setConstant(NAN);
  }
}

struct Row {
  SceneScore score;
  std::vector<double> milliseconds;
};

void print(const std::string& name, const Row& row) {
  std::printf(
      "%-16s %3d scenes  best right %5.1f %%  recall %5.1f %% (%d/%d)  precision %5.1f %% (%d wrong)  median %.1f ms\n",
      name.c_str(), row.score.scenes, 100.0 * row.score.best_right / row.score.scenes, 100 * row.score.recall(),
      row.score.hits, row.score.instances, 100 * row.score.precision(), row.score.wrong, median(row.milliseconds));
}

/// One line of a hypothesis for whoever studies what is right and what is wrong.
void print_hypothesis(const std::string& scene, int verdict, const PoseHypothesis& p, int variants_right = 0) {
  const Eigen::Vector3d t = p.T_scene_model.translation();
  const Eigen::Quaterniond q(p.T_scene_model.linear());
  std::printf(
      "H %s %d %.3f expl %.3f viol %.3f occl %.3f unex %.3f conf %.3f contr %.3f certain %.3f area %.3f res %.3f "
      "votes %.2f variants %zu right %d POSE %.5f %.5f %.5f %.5f %.5f %.5f %.5f\n",
      scene.c_str(), verdict, p.score, p.explained_fraction, p.violated_fraction, 1 - p.visible_fraction,
      p.unexplained_fraction, p.outline_confirmed, p.outline_contradicted, p.confidence, p.explained_area,
      1e3 * p.residual, p.votes, p.variants.size(), variants_right, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void add(DetectStats& sum, const DetectStats& s) {
  sum.preprocess_seconds += s.preprocess_seconds;
  sum.vote_seconds += s.vote_seconds;
  sum.cluster_seconds += s.cluster_seconds;
  sum.refine_seconds += s.refine_seconds;
  sum.verify_seconds += s.verify_seconds;
  sum.rank_seconds += s.rank_seconds;
  sum.total_seconds += s.total_seconds;
  sum.start_point_count += s.start_point_count;
  sum.scene_pair_count += s.scene_pair_count;
  sum.vote_count += s.vote_count;
  sum.cluster_count += s.cluster_count;
  sum.verified_count += s.verified_count;
}

using Trained = std::map<std::string, std::pair<Model, PoseJudge>>;

/// Trains the parts of a folder, or the one named `only`, or ends the program saying which it can't.
Trained train_all(const std::string& parts_folder, const std::string& only, const TrainParams& train_params,
                  const RunControl& control) {
  Trained trained;
  for (const ScenePart& part : read_parts(parts_folder)) {
    if (!only.empty() && part.name != only) continue;
    const auto start = std::chrono::steady_clock::now();
    absl::StatusOr<Model> model = train(part.mesh, train_params, control);
    if (!model.ok()) {
      std::fprintf(stderr, "%s: %s\n", part.name.c_str(), model.status().ToString().c_str());
      std::exit(1);
    }
    std::printf("%-16s trained in %.2f s: %zu surface points, %zu pair points, %zu pairs\n", part.name.c_str(),
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), model->surface.size(),
                model->pair_points.size(), model->pairs.size());
    std::printf("%-16s symmetry: %zu turns%s; %zu similar poses, %zu telling points %.2f mm\n", "",
                model->symmetry.discrete.size(), model->symmetry.has_axis ? " and an axis" : "",
                model->similar_poses.size(), model->telling_points.size(), 1000 * model->telling_spacing);
    trained.emplace(part.name, std::pair(*std::move(model), PoseJudge(part)));
  }
  return trained;
}

/// The answer of the fastest of a few equal searches: other work on the machine only ever adds time.
absl::StatusOr<DetectResult> fastest_of(int repeats, const PointCloud& cloud, std::span<const Model* const> models,
                                        const DetectParams& params, const RunControl& control) {
  absl::StatusOr<DetectResult> best = detect(cloud, models, params, control);
  for (int i = 1; i < repeats && best.ok(); ++i) {
    absl::StatusOr<DetectResult> next = detect(cloud, models, params, control);
    if (next.ok() && next->stats.total_seconds < best->stats.total_seconds) best = std::move(next);
  }
  return best;
}

/// Searches a scene for every part but its own and prints all that is found.
bool search_for_wrong_parts(const BinScene& scene, const Trained& trained, const DetectParams& detect_params,
                            const RunControl& control) {
  for (const auto& [name, other] : trained) {
    if (name == scene.part) continue;
    const Model* const models[] = {&other.first};
    const absl::StatusOr<DetectResult> result = detect(scene.cloud, models, detect_params, control);
    if (!result.ok()) return false;
    for (const PoseHypothesis& p : result->hypotheses) {
      print_hypothesis(scene.name + "/" + name, -2, p);
    }
  }
  return true;
}

/// What can be left out to see what it brings, by name.
using Step = void (*)(TrainParams&, DetectParams&);
const std::map<std::string, Step>& steps() {
  static const std::map<std::string, Step> all = {
      {"contours", [](TrainParams&, DetectParams& detect) { detect.use_contours = false; }},
      {"normal-gate", [](TrainParams&, DetectParams& detect) { detect.normal_tolerance = 180 * kDegree; }},
      {"plane-removal", [](TrainParams&, DetectParams& detect) { detect.remove_support_plane = false; }},
      {"promise", [](TrainParams&, DetectParams& detect) { detect.least_promise = -2; }},
      {"refinement", [](TrainParams&, DetectParams& detect) { detect.refine = false; }},
      {"presence", [](TrainParams&, DetectParams& detect) { detect.presence_score = 0; }},
      {"signal-to-noise", [](TrainParams& train, DetectParams&) { train.selection = PairSelection::kIntegration; }},
      {"second-lengths", [](TrainParams& train, DetectParams&) { train.pair_lengths.resize(1); }},
      {"pairs",
       [](TrainParams& train, DetectParams&) { train.pairs_per_point = TrainParams::paper().pairs_per_point; }},
  };
  return all;
}

}  // namespace

int main(int argc, char** argv) {  // NOLINT(readability-function-size): one line an option
  CLI::App app("Searches whole scenes and compares with the truth.");
  std::string parts_folder, scenes_folder, filter, only;
  bool wrong_parts = false;
  bool ply = false, per_scene = false, dump = false;
  RunControl control;
  DetectParams detect_params;
  TrainParams train_params;
  app.add_option("parts", parts_folder)->required();
  app.add_option("scenes", scenes_folder)->required();
  app.add_option("--filter", filter);
  app.add_option("--part", only, "trains this part alone and takes its scenes only");
  app.add_flag("--wrong-parts", wrong_parts, "search each scene for every part but its own: all found is wrong");
  app.add_flag("--ply", ply);
  app.add_flag("--per-scene", per_scene);
  app.add_flag("--dump", dump);
  app.add_option("--threads", control.threads);
  std::string effort = "balanced";
  const CLI::Validator efforts = CLI::IsMember({"fast", "balanced", "thorough"});
  app.add_option("--effort", effort, "the base that the other options change")->check(efforts);
  std::optional<double> min_score, presence_score, share;
  app.add_option("--min-score", min_score);
  app.add_option("--presence-score", presence_score);
  bool accept_ambiguous = false;
  app.add_flag("--accept-ambiguous", accept_ambiguous);
  app.add_option("--pairs", train_params.pairs_per_point);
  app.add_option("--share", share);
  std::map<std::string, PairSelection> selections = {{"distinctiveness", PairSelection::kDistinctiveness},
                                                     {"observability", PairSelection::kObservability},
                                                     {"integration", PairSelection::kIntegration}};
  PairSelection paper_selection = PairSelection::kIntegration;
  const CLI::Option* paper =
      app.add_option("--paper", paper_selection, "the paper's preset with this selection of pairs")
          ->transform(CLI::CheckedTransformer(selections));
  int repeats = 1;
  app.add_option("--repeat", repeats, "searches of each scene; the fastest counts");
  double noise_mm = 0, point_share = 1;
  app.add_option("--noise-mm", noise_mm, "more range noise, standard deviation along the ray");
  app.add_option("--point-share", point_share, "share of the points that is kept, at random");
  std::optional<int> cluster_limit;
  app.add_option("--clusters", cluster_limit, "clusters of votes that are looked at, per source");
  std::vector<std::string> left_out;
  app.add_option("--without", left_out, "steps of the method that are left out")->check(CLI::IsMember(&steps()));
  CLI11_PARSE(app, argc, argv);
  if (paper->count() > 0) {
    train_params = TrainParams::paper();
    train_params.selection = paper_selection;
    detect_params = DetectParams::paper();
  }
  if (effort == "fast") detect_params = DetectParams::fast();
  if (effort == "thorough") detect_params = DetectParams::thorough();
  for (const std::string& step : left_out) steps().at(step)(train_params, detect_params);
  if (min_score) detect_params.min_score = *min_score;
  if (presence_score) detect_params.presence_score = *presence_score;
  detect_params.accept_ambiguous = accept_ambiguous;
  if (share) detect_params.start_point_share = *share;
  if (cluster_limit) detect_params.cluster_limit = *cluster_limit;

  const Trained trained = train_all(parts_folder, only, train_params, control);

  std::map<std::string, Row> rows;
  Row all;
  DetectStats sum;
  const std::vector<std::filesystem::path> folders = scene_folders(scenes_folder, filter);
  for (const auto& folder : folders) {
    BinScene scene = read_scene(folder, ply);
    degrade(scene.cloud, noise_mm / 1000, point_share, static_cast<unsigned>(&folder - folders.data()));
    if (!only.empty() && scene.part != only) continue;
    if (wrong_parts) {
      if (!search_for_wrong_parts(scene, trained, detect_params, control)) return 1;
      continue;
    }
    const auto& [model, judge] = trained.at(scene.part);
    const Model* const models[] = {&model};
    const absl::StatusOr<DetectResult> result = fastest_of(repeats, scene.cloud, models, detect_params, control);
    if (!result.ok()) {
      std::fprintf(stderr, "%s: %s\n", scene.name.c_str(), result.status().ToString().c_str());
      return 1;
    }
    std::vector<int> verdicts;
    const SceneScore score = judge.score(result->hypotheses, scene.instances, &verdicts);
    for (Row* row : {&rows[scene.part], &all}) {
      row->score += score;
      row->milliseconds.push_back(1000 * result->stats.total_seconds);
    }
    if (per_scene) print(scene.name, {score, {1000 * result->stats.total_seconds}});
    for (std::size_t h = 0; h < result->hypotheses.size() && dump; ++h) {
      const PoseHypothesis& p = result->hypotheses[h];
      int right = 0;
      for (const Pose& variant : p.variants) {
        for (const SceneInstance& i : scene.instances) right += judge.right(variant, i.T_scene_model) ? 1 : 0;
      }
      print_hypothesis(scene.name, verdicts[h], p, right);
    }
    const DetectStats& s = result->stats;
    add(sum, s);
  }
  for (const auto& [name, row] : rows) print(name, row);
  if (folders.empty() || wrong_parts) return folders.empty() ? 1 : 0;
  print("ALL", all);
  const auto n = static_cast<double>(std::max<std::size_t>(1, all.milliseconds.size()));
  std::printf("mean ms: preprocess %.1f vote %.1f cluster %.1f refine %.1f verify %.1f rank %.1f total %.1f\n",
              1000 * sum.preprocess_seconds / n, 1000 * sum.vote_seconds / n, 1000 * sum.cluster_seconds / n,
              1000 * sum.refine_seconds / n, 1000 * sum.verify_seconds / n, 1000 * sum.rank_seconds / n,
              1000 * sum.total_seconds / n);
  std::printf("mean counts: starts %.0f pairs %.0f votes %.0f clusters %.0f verified %.0f\n", sum.start_point_count / n,
              sum.scene_pair_count / n, sum.vote_count / n, sum.cluster_count / n, sum.verified_count / n);
}

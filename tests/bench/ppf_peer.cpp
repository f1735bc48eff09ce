/// Side by side with OpenCV's point-pair features (cv::ppf_match_3d::PPF3DDetector), both on one thread:
///
///   binpose-bench-ppf PARTS SCENES [--filter TEXT] [--ply]
///
/// Ours runs with default parameters. The peer is made as good as it was found to get (tuned on 16 of the simulated
/// bins, two a part), with our help wherever its own means were worse; its time is all from the cloud to the poses:
///  - Points and normals of our depth map, without the support plane; with it, recall and precision were lower.
///  - Model: 300 evenly spread points of our sampling; 400 and 600 took longer for the same, 200 found less. Its own
///    sampling divides each side of the bounding box alike: of a slim part it takes several times as many points, which
///    trains for over a minute and takes 15 s a scene.
///  - Steps: scene 0.04, and every second scene point a reference. Finer scenes, every fifth or tenth point, wider
///    angle steps, and cubic cells or our own thinning of the scene were slower, found less, or both.
///  - Clusters: its clustering compares angles of rotation without their axes and averages what has no mean. With
///    thresholds so narrow that hardly a pose is merged, recall grew from 78 to 87 %. The 1000 of most votes are kept.
///  - Ranking: by votes alone, with or without its ICP, less than a third of the parts was found where it was tried.
///    So all poses are refined, verified, ranked and rid of doubles by our code.
///  - Threshold: on our score, chosen with the truth known: the largest F1 over all scenes. Ours gets no such choice.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/surface_matching/ppf_match_3d.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/detect/detect.h"
#include "core/detect/judge.h"
#include "core/detect/prepare.h"
#include "core/detect/rank.h"
#include "core/detect/refine.h"
#include "core/detect/stage_timer.h"
#include "core/train/train.h"
#include "tests/support/bin_scene.h"
#include "tests/support/median.h"
#include "tests/support/scene_score.h"

namespace {

using namespace binpose;           // NOLINT
using namespace binpose::testing;  // NOLINT
namespace ppf = cv::ppf_match_3d;

/// What was tuned of the peer; the steps are shares of the model's and the scene's extent.
struct PeerOptions {
  std::size_t model_points = 300;
  double model_step = 0.045;
  double scene_step = 0.04;
  int reference_stride = 2;
  std::size_t pose_limit = 1000;
};

/// A part as both detectors know it.
struct TrainedPart {
  Model model;
  std::unique_ptr<ppf::PPF3DDetector> peer;
  PoseJudge judge;
};

/// What one detector said of one scene.
struct Answer {
  std::vector<PoseHypothesis> hypotheses;  ///< best first, scores falling
  double seconds = 0;
};

/// A scene's truth and both answers.
struct Comparison {
  const TrainedPart* part;
  std::vector<SceneInstance> instances;
  Answer ours, peers;
};

struct Row {
  SceneScore score;
  std::vector<double> seconds;
};

/// Points with normals as OpenCV has them: a row of six each.
cv::Mat to_rows(std::span<const SurfacePoint> points) {
  cv::Mat rows(static_cast<int>(points.size()), 6, CV_32F);
  for (int i = 0; i < rows.rows; ++i) {
    Eigen::Map<Eigen::Vector3f>(rows.ptr<float>(i)) = points[i].position;
    Eigen::Map<Eigen::Vector3f>(rows.ptr<float>(i) + 3) = points[i].normal;
  }
  return rows;
}

TrainedPart train_both(const ScenePart& part, const PeerOptions& options) {
  constexpr double kMergeDistance = 1e-4;  // diameters
  constexpr double kMergeAngle = 1e-3;
  absl::StatusOr<Model> model = train(part.mesh, {}, {});
  if (!model.ok()) throw std::runtime_error(part.name + ": " + model.status().ToString());
  auto peer = std::make_unique<ppf::PPF3DDetector>(options.model_step, options.model_step);
  peer->setSearchParams(kMergeDistance * model->diameter, kMergeAngle);
  const std::size_t count = std::min(options.model_points, model->surface.size());
  peer->trainModel(to_rows({model->surface.data(), count}));  // a prefix of the surface is evenly spread
  return {*std::move(model), std::move(peer), PoseJudge(part)};
}

Answer detect_by_ours(const PointCloud& cloud, const Model& model) {
  const auto start = std::chrono::steady_clock::now();
  const Model* const models[] = {&model};
  absl::StatusOr<DetectResult> result = detect(cloud, models, {}, {});
  if (!result.ok()) throw std::runtime_error(result.status().ToString());
  return {std::move(result->hypotheses), seconds_since(start)};
}

/// The peer's poses of a scene, T_view_model, most votes first.
std::vector<Eigen::Isometry3f> match(const DepthMap& map, ppf::PPF3DDetector& peer, const PeerOptions& options) {
  std::vector<SurfacePoint> points;
  for (int i = 0; i < map.width * map.height; ++i) {
    if (map.has_normal(i) && !map.background[i]) points.push_back(map.pixels[i]);
  }
  std::vector<ppf::Pose3DPtr> found;
  if (!points.empty()) peer.match(to_rows(points), found, 1.0 / options.reference_stride, options.scene_step);
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a->numVotes > b->numVotes; });
  if (found.size() > options.pose_limit) found.resize(options.pose_limit);
  std::vector<Eigen::Isometry3f> poses;
  for (const ppf::Pose3DPtr& pose : found) {
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(pose->pose.val);
    poses.emplace_back(Eigen::Matrix4f(matrix.cast<float>()));
  }
  return poses;
}

/// Refinement from the accuracy of votes to that of the sensor, as in our own search but for all poses.
Eigen::Isometry3f refine_to_the_end(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model) {
  const auto diameter = static_cast<float>(model.diameter);
  const RefineOptions coarse = {0.08F * diameter, 0.025F * diameter, 6, 200, 2};
  const RefineOptions fine = {0.025F * diameter, 0.015F * diameter, 3, 400, 1};
  return refine(map, model, refine(map, model, T_view_model, coarse), fine);
}

Answer detect_by_peer(const PointCloud& cloud, const TrainedPart& part, const PeerOptions& options) {
  constexpr double kLeastScore = 0.1;  // lower than any threshold that serves
  const auto start = std::chrono::steady_clock::now();
  const Model& model = part.model;
  const absl::StatusOr<SensorView> view = sensor_view(cloud);
  if (!view.ok()) throw std::runtime_error(view.status().ToString());
  const DepthMap map = prepare(*view, model, {});
  const VerifyOptions verification = final_verification(map, model);
  std::vector<Candidate> candidates;
  for (const Eigen::Isometry3f& T_view_model : match(map, *part.peer, options)) {
    Candidate& candidate = candidates.emplace_back();
    candidate.T_view_model = refine_to_the_end(map, model, T_view_model);
    candidate.evidence = verify(map, model, candidate.T_view_model, verification);
  }
  RankOptions ranking;
  ranking.verification = {&verification, 1};
  ranking.min_score = kLeastScore;
  const Model* const models[] = {&model};
  Answer answer;
  for (const Candidate& candidate : rank(map, models, std::move(candidates), ranking).accepted) {
    PoseHypothesis& hypothesis = answer.hypotheses.emplace_back();
    hypothesis.T_scene_model = map.T_scene_view * Pose(candidate.T_view_model.cast<double>());
    hypothesis.score = candidate.score();
  }
  answer.seconds = seconds_since(start);
  return answer;
}

/// The threshold on the peer's scores that gives it the largest F1 over all scenes.
double best_threshold(const std::vector<Comparison>& comparisons) {
  std::vector<std::pair<double, int>> judged;  // score and verdict; a verdict does not depend on lower scores
  int instances = 0;
  for (const Comparison& c : comparisons) {
    std::vector<int> verdicts;
    instances += c.part->judge.score(c.peers.hypotheses, c.instances, &verdicts).instances;
    for (std::size_t i = 0; i < verdicts.size(); ++i) judged.emplace_back(c.peers.hypotheses[i].score, verdicts[i]);
  }
  std::sort(judged.rbegin(), judged.rend());
  double best = 0, best_f1 = -1;
  int hits = 0, wrong = 0;
  for (const auto& [score, verdict] : judged) {
    hits += verdict > 0;
    wrong += verdict < 0;
    const double f1 = 2.0 * hits / (hits + wrong + instances);
    if (f1 > best_f1) std::tie(best, best_f1) = std::pair(score, f1);
  }
  return best;
}

void print(const std::string& part, const char* detector, const Row& row) {
  std::printf("%-16s %-6s best right %5.1f %%  recall %5.1f %% (%d/%d)  precision %5.1f %% (%d wrong)  median %.4f s\n",
              part.c_str(), detector, 100.0 * row.score.best_right / row.score.scenes, 100 * row.score.recall(),
              row.score.hits, row.score.instances, 100 * row.score.precision(), row.score.wrong, median(row.seconds));
}

void report(const std::map<std::string, std::vector<Comparison>>& by_part) {
  std::vector<Comparison> all;
  for (const auto& [name, comparisons] : by_part) all.insert(all.end(), comparisons.begin(), comparisons.end());
  const double threshold = best_threshold(all);
  std::printf("the peer's threshold: %.3f, best for it over all scenes\n", threshold);
  const auto print_both = [&](const std::string& name, const std::vector<Comparison>& comparisons) {
    Row ours, peers;
    for (const Comparison& c : comparisons) {
      std::vector<PoseHypothesis> kept = c.peers.hypotheses;
      std::erase_if(kept, [&](const PoseHypothesis& h) { return h.score < threshold; });
      ours.score += c.part->judge.score(c.ours.hypotheses, c.instances);
      peers.score += c.part->judge.score(kept, c.instances);
      ours.seconds.push_back(c.ours.seconds);
      peers.seconds.push_back(c.peers.seconds);
    }
    print(name, "ours", ours);
    print(name, "OpenCV", peers);
    std::printf("%-16s ratio of the medians %.1f\n", name.c_str(), median(peers.seconds) / median(ours.seconds));
  };
  for (const auto& [name, comparisons] : by_part) print_both(name, comparisons);
  print_both("ALL", all);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Compares with OpenCV's point-pair features, side by side.");
  std::string parts_folder, scenes_folder, filter;
  bool ply = false;
  PeerOptions options;
  app.add_option("parts", parts_folder)->required();
  app.add_option("scenes", scenes_folder)->required();
  app.add_option("--filter", filter, "takes only scenes whose names hold this");
  app.add_flag("--ply", ply, "read the scans as unordered clouds");
  app.add_option("--model-points", options.model_points, "of the peer");
  app.add_option("--scene-step", options.scene_step, "of the peer, as a share of the scene's extent");
  app.add_option("--reference-stride", options.reference_stride, "of the peer")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);

  const std::vector<std::filesystem::path> folders = scene_folders(scenes_folder, filter);
  std::map<std::string, ScenePart> parts;
  for (ScenePart& part : read_parts(parts_folder)) parts.emplace(part.name, std::move(part));
  std::map<std::string, TrainedPart> trained;
  std::map<std::string, std::vector<Comparison>> by_part;
  for (const auto& folder : folders) {
    const BinScene scene = read_scene(folder, ply);
    if (!trained.contains(scene.part)) trained.emplace(scene.part, train_both(parts.at(scene.part), options));
    const TrainedPart& part = trained.at(scene.part);
    by_part[scene.part].push_back(
        {&part, scene.instances, detect_by_ours(scene.cloud, part.model), detect_by_peer(scene.cloud, part, options)});
  }
  if (folders.empty()) return 1;
  report(by_part);
}

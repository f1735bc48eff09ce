#include "core/detect/detect.h"

#include <algorithm>
#include <chrono>

#include "absl/strings/str_format.h"
#include "core/detect/all_sides.h"
#include "core/detect/describe.h"
#include "core/detect/judge.h"
#include "core/detect/prepare.h"
#include "core/detect/rank.h"
#include "core/detect/search.h"
#include "core/detect/stage_timer.h"
#include "core/geometry/depth_map.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// One sentence for an empty result: how far the search came.
std::string why_nothing_was_found(const DetectStats& stats, float best_doubtful, const DetectParams& params) {
  if (stats.stop_reason == StopReason::kDeadline) return "The time ran out before a pose was verified.";
  if (stats.start_point_count == 0) {
    return "No surface was found to start from: the cloud is too sparse for the part, or all of it is support plane.";
  }
  if (stats.vote_count == 0) return "Nothing in the cloud resembles the part: check the unit and the model.";
  if (best_doubtful > 0) {
    return absl::StrFormat(
        "The best pose proves the part by %.2f (its score, times its explained_area below 1), less than presence_score "
        "(%.2f): the part is not there, or all that shows of it is too little to be sure.",
        best_doubtful, params.presence_score);
  }
  return "No pose reached min_score: the part is not there, or less of it is visible than the score asks for.";
}

/// A sentence for parts that were left out for what the scan does not tell.
std::string what_was_ambiguous(int places) {
  return absl::StrFormat(
      "%d more %s: the scan shows the part, but not in which of several nearly alike poses; accept_ambiguous answers "
      "such.",
      places, places == 1 ? "place" : "places");
}

/// A sentence for a cloud that surrounds its sensor, as one does that was moved without it; empty for any other.
std::string why_the_sensor_is_doubtful(const SensorView& view) {
  constexpr double kStray = 0.05;
  if (view.share_behind <= kStray) return "";
  const Eigen::Vector3d sensor = view.T_scene_view.translation();
  return absl::StrFormat(
      "%.0f %% of the points lie beside or behind sensor_position (%g, %g, %g) m and were left out: it must say where "
      "the cloud was measured from.",
      100 * view.share_behind, sensor.x(), sensor.y(), sensor.z());
}

}  // namespace

absl::StatusOr<DetectResult> detect(const PointCloud& cloud, std::span<const Model* const> models,
                                    const DetectParams& params, const RunControl& control) {
  const auto start = std::chrono::steady_clock::now();
  if (absl::Status status = validate(params); !status.ok()) return status;
  if (models.empty()) return absl::InvalidArgumentError("models is empty; it must name at least 1.");
  const absl::StatusOr<SensorView> view = sensor_view(cloud, control);
  if (!view.ok()) return view.status();
  DetectResult result;
  DetectStats& stats = result.stats;
  stats.point_count = view->points.size();
  const std::string doubt = why_the_sensor_is_doubtful(*view);
  if (!doubt.empty()) result.warnings.push_back(doubt);

  DepthMap finest;  // where models of several sizes meet
  std::vector<Candidate> candidates;
  std::vector<VerifyOptions> verification;
  for (std::size_t m = 0; m < models.size() && !control.stop.stop_requested(); ++m) {
    const RunControl turn = control.with_share_of_time(1.0 / static_cast<double>(models.size() - m));
    DepthMap map;
    {
      const StageTimer timer(stats.preprocess_seconds);
      map = prepare(*view, *models[m], params, turn);
    }
    const std::vector<Candidate> found =
        all_points_decide(map, params)
            ? search_all_sides(*view, map, *models[m], static_cast<int>(m), params, turn, stats)
            : search(map, *models[m], static_cast<int>(m), params, turn, stats);
    if (turn.past_deadline()) stats.stop_reason = StopReason::kDeadline;
    candidates.insert(candidates.end(), found.begin(), found.end());
    verification.push_back(final_verification(map, *models[m]));
    if (m == 0 || map.pixel_size < finest.pixel_size) finest = std::move(map);
  }
  if (control.stop.stop_requested()) return control.status();

  const auto describe_all = [&](const std::vector<Candidate>& all) {
    std::vector<PoseHypothesis> described(all.size());
    parallel_for(static_cast<int>(all.size()), control.threads, [&](int i) {
      const int m = all[i].model_index;
      described[i] = describe(all[i], finest, *models[m], verification[m], params);
    });
    return described;
  };
  float best_doubtful = 0;
  int ambiguous_places = 0;
  if (params.verification == Verification::kVisibleSurface) {
    const StageTimer timer(stats.rank_seconds);
    const RankOptions options = {.verification = verification,
                                 .min_score = params.min_score,
                                 .presence_score = params.presence_score,
                                 .accept_ambiguous = params.accept_ambiguous,
                                 .max_rejected = params.max_rejected,
                                 .allowed = [&](int m, const Eigen::Isometry3f& T_view_model) {
                                   return is_allowed(finest, *models[m], m, params.space, {}, T_view_model);
                                 }};
    Ranking ranking = rank(finest, models, std::move(candidates), options, control);
    if (control.stop.stop_requested()) return control.status();
    candidates = std::move(ranking.accepted);
    best_doubtful = ranking.best_doubtful;
    ambiguous_places = ranking.ambiguous_places;
    result.rejected = describe_all(ranking.rejected);
  }
  if (control.past_deadline()) stats.stop_reason = StopReason::kDeadline;
  if (candidates.size() > static_cast<std::size_t>(params.max_results)) {
    candidates.resize(params.max_results);
    if (stats.stop_reason == StopReason::kComplete) stats.stop_reason = StopReason::kMaxResults;
  }
  for (Candidate& candidate : candidates) {
    std::erase_if(candidate.occluded_by, [&](int i) { return i >= params.max_results; });
  }
  result.hypotheses = describe_all(candidates);
  if (ambiguous_places > 0) {
    result.warnings.push_back(what_was_ambiguous(ambiguous_places));
  } else if (result.hypotheses.empty()) {
    result.warnings.push_back(why_nothing_was_found(stats, best_doubtful, params));
  }
  stats.total_seconds = seconds_since(start);
  return result;
}

}  // namespace binpose

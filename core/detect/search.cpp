#include "core/detect/search.h"

#include <algorithm>
#include <cmath>

#include "core/detect/cluster.h"
#include "core/detect/contour_votes.h"
#include "core/detect/refine.h"
#include "core/detect/scene_points.h"
#include "core/detect/stage_timer.h"
#include "core/detect/vote.h"
#include "core/parallel.h"

namespace binpose {
namespace {

// Lengths as shares of the diameter D.
constexpr double kRelativeBlock = 0.042;
constexpr float kClusterRadius = 0.06F;
constexpr float kNeighbourhood = 0.25F;
constexpr float kCoarseTolerance = 0.04F;
constexpr float kFinalTolerance = 0.006F;
constexpr float kNoiseTolerance = 2.5F;
constexpr float kFirstGate = 0.08F;
constexpr float kLastGate = 0.025F;

constexpr int kCoarsePoints = 80;
constexpr int kCoarseOutlineStride = 3;
constexpr int kFirstIterations = 4;
constexpr int kFirstPoints = 100;
constexpr int kFirstOutlineStride = 3;
constexpr int kMiddlePoints = 300;
constexpr float kRepeat = 0.02F;
constexpr float kFinestGate = 0.015F;
constexpr int kFinestIterations = 3;
constexpr int kFinestPoints = 400;
constexpr float kAlignmentCutoff = 0.1F;
constexpr double kVotedAngle = 25 * kDegree;  // that a pose made of votes may be off

// Of the time left before a deadline: votes that nobody has the time to verify are worth nothing.
constexpr double kSurfaceVotesShare = 0.25;
constexpr double kContourVotesShare = 0.25;

Eigen::Isometry3f pose_of(const PoseCluster& cluster, const Model& model) {
  Eigen::Isometry3f T_view_model(cluster.q_view_model);
  T_view_model.translation() = cluster.centre - T_view_model.linear() * model.centre.cast<float>();
  return T_view_model;
}

/// Judges every candidate, in parallel.
void verify_all(const DepthMap& map, const Model& model, const VerifyOptions& options, const RunControl& control,
                std::vector<Candidate>& candidates) {
  parallel_for(static_cast<int>(candidates.size()), control.threads, [&](int i) {
    if (!control.interrupted()) candidates[i].evidence = verify(map, model, candidates[i].T_view_model, options);
  });
}

/// Whether two poses are turned alike, but for what refinement leaves.
bool same_turn(const Candidate& a, const Candidate& b) {
  constexpr float kLeastTrace = 2.985F;  // 7 degrees
  return a.T_view_model.linear().cwiseProduct(b.T_view_model.linear()).sum() > kLeastTrace;
}

void sort_by(float (Evidence::*merit)() const, std::vector<Candidate>& candidates) {
  std::stable_sort(candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
    return (a.evidence.*merit)() > (b.evidence.*merit)();
  });
}

/// The first candidates of each neighbourhood, without those that repeat an earlier one within `repeat` metres.
std::vector<Candidate> first_of_each_place(const std::vector<Candidate>& candidates, const Model& model, int per_place,
                                           int most, float repeat) {
  const Eigen::Vector3f centre = model.centre.cast<float>();
  const float reach = kNeighbourhood * static_cast<float>(model.diameter);
  std::vector<Candidate> kept;
  std::vector<Eigen::Vector3f> places;
  for (const Candidate& candidate : candidates) {
    if (static_cast<int>(kept.size()) >= most) break;
    const Eigen::Vector3f place = candidate.T_view_model * centre;
    int around = 0;
    bool repeats = false;
    for (std::size_t i = 0; i < kept.size() && !repeats; ++i) {
      const float sq_distance = (places[i] - place).squaredNorm();
      around += static_cast<int>(sq_distance < reach * reach);
      repeats = sq_distance < repeat * repeat && same_turn(candidate, kept[i]);
    }
    if (repeats || around >= per_place) continue;
    kept.push_back(candidate);
    places.push_back(place);
  }
  return kept;
}

Votes surface_votes(const DepthMap& map, const Model& model, const DetectParams& params, const RunControl& control,
                    DetectStats& stats) {
  const int block = std::max(1, static_cast<int>(std::lround(kRelativeBlock * model.diameter / map.pixel_size)));
  const ScenePoints scene = down_sample(map, block);
  const std::vector<int> starts = start_points(scene, params.start_point_share);
  stats.start_point_count += starts.size();
  return vote(scene, starts, map, model, params, control);
}

/// Leaves out the votes for places outside of every region, lest they take the clusters of those inside.
void keep_votes_in_regions(const DepthMap& map, const SearchSpace& space, double slack, std::vector<PoseVote>& votes) {
  if (space.regions.empty()) return;
  std::erase_if(votes, [&](const PoseVote& vote) {
    return !in_a_region(space, map.T_scene_view * vote.centre.cast<double>(), slack);
  });
}

/// Clusters of votes that stand a coarse verification: where the model may be, best first.
std::vector<Candidate> find_candidates(Votes votes, const DepthMap& map, const Model& model, int model_index,
                                       const DetectParams& params, const RunControl& control, DetectStats& stats) {
  const auto diameter = static_cast<float>(model.diameter);
  stats.scene_pair_count += votes.scene_pairs;
  stats.vote_count += votes.votes.size();
  std::vector<Candidate> candidates;
  {
    const StageTimer timer(stats.cluster_seconds);
    const Slack voted = {kClusterRadius * model.diameter, kVotedAngle};
    keep_votes_in_regions(map, params.space, voted.distance, votes.votes);
    ClusterOptions options;
    options.radius = kClusterRadius * diameter;
    options.neighbourhood = kNeighbourhood * diameter;
    options.most_per_neighbourhood = params.clusters_per_place;
    options.most = params.cluster_limit;
    for (const PoseCluster& c : cluster(votes.votes, options, control)) {
      Candidate candidate;
      candidate.model_index = model_index;
      candidate.T_view_model = pose_of(c, model);
      candidate.votes = c.votes;
      if (is_allowed(map, model, model_index, params.space, voted, candidate.T_view_model)) {
        candidates.push_back(candidate);
      }
    }
    stats.cluster_count += candidates.size();
  }
  // The paper compares each cluster with all points, and with nothing before.
  if (params.verification == Verification::kAllPoints) return candidates;
  const StageTimer timer(stats.verify_seconds);
  VerifyOptions coarse;
  coarse.tolerance = kCoarseTolerance * diameter;
  coarse.normal_cosine = 0.7F;
  coarse.most_points = kCoarsePoints;
  coarse.outline_stride = kCoarseOutlineStride;
  verify_all(map, model, coarse, control, candidates);
  sort_by(&Evidence::promise, candidates);
  return first_of_each_place(candidates, model, params.refined_per_place, params.refine_limit, 0);
}

/// Refines each candidate and judges it anew.
void refine_all(const DepthMap& map, const Model& model, const RefineOptions& refinement,
                const VerifyOptions& verification, const RunControl& control, std::vector<Candidate>& candidates,
                DetectStats& stats) {
  {
    const StageTimer timer(stats.refine_seconds);
    parallel_for(static_cast<int>(candidates.size()), control.threads, [&](int i) {
      if (control.interrupted()) return;
      candidates[i].T_view_model = refine(map, model, candidates[i].T_view_model, refinement);
    });
  }
  const StageTimer timer(stats.verify_seconds);
  verify_all(map, model, verification, control, candidates);
  stats.verified_count += candidates.size();
}

/// Refinement from the accuracy of votes to that of the sensor: all candidates with few points, the best with many.
std::vector<Candidate> refine_to_the_end(const DepthMap& map, const Model& model, std::vector<Candidate> candidates,
                                         const DetectParams& params, const RunControl& control, DetectStats& stats) {
  const auto diameter = static_cast<float>(model.diameter);
  RefineOptions refinement;
  refinement.first_gate = kFirstGate * diameter;
  refinement.last_gate = kLastGate * diameter;
  refinement.iterations = kFirstIterations;
  refinement.most_points = kFirstPoints;
  refinement.outline_stride = kFirstOutlineStride;
  VerifyOptions verification = final_verification(map, model);
  verification.most_points = kMiddlePoints;
  refine_all(map, model, refinement, verification, control, candidates, stats);
  sort_by(&Evidence::score, candidates);
  candidates =
      first_of_each_place(candidates, model, params.finalists_per_place, params.finalist_limit, kRepeat * diameter);
  refinement.first_gate = kLastGate * diameter;
  refinement.last_gate = kFinestGate * diameter;
  refinement.iterations = kFinestIterations;
  refinement.most_points = kFinestPoints;
  refinement.outline_stride = 1;
  refine_all(map, model, refinement, final_verification(map, model), control, candidates, stats);
  return candidates;
}

/// The clusters by the paper's alignment error, one a place.
std::vector<Candidate> compare_all_points(std::vector<Candidate> candidates, const DepthMap& map, const Model& model,
                                          const DetectParams& params, DetectStats& stats) {
  const StageTimer timer(stats.verify_seconds);
  const float cutoff = kAlignmentCutoff * static_cast<float>(model.diameter);
  for (Candidate& candidate : candidates) {
    candidate.evidence = {};
    candidate.evidence.area = candidate.evidence.outline_confirmed = 1;
    candidate.evidence.explained = alignment_score(map, model, candidate.T_view_model, cutoff);
  }
  stats.verified_count += candidates.size();
  sort_by(&Evidence::score, candidates);
  return first_of_each_place(candidates, model, 1, params.finalist_limit, 0);
}

}  // namespace

VerifyOptions final_verification(const DepthMap& map, const Model& model) {
  VerifyOptions options;
  options.tolerance = kFinalTolerance * static_cast<float>(model.diameter) + kNoiseTolerance * map.noise;
  return options;
}

bool is_allowed(const DepthMap& map, const Model& model, int model_index, const SearchSpace& space, const Slack& slack,
                const Eigen::Isometry3f& T_view_model) {
  return allows(space, model_index, model.symmetry, model.centre, map.T_scene_view * Pose(T_view_model.cast<double>()),
                map.T_scene_view.translation(), slack);
}

std::vector<Candidate> search(const DepthMap& map, const Model& model, int model_index, const DetectParams& params,
                              const RunControl& control, DetectStats& stats) {
  Votes by_surface, by_contour;
  {
    const StageTimer timer(stats.vote_seconds);
    const RunControl first = control.with_share_of_time(kSurfaceVotesShare);
    by_surface = surface_votes(map, model, params, first, stats);
    const RunControl second = control.with_share_of_time(kContourVotesShare);
    if (params.use_contours) by_contour = contour_votes(map, model, second);
    if (first.past_deadline() || second.past_deadline()) stats.stop_reason = StopReason::kDeadline;
  }
  // A list of its own for each source, so that contours need not outvote surfaces or be outvoted.
  if (control.stop.stop_requested()) return {};
  std::vector<Candidate> candidates =
      find_candidates(std::move(by_surface), map, model, model_index, params, control, stats);
  const std::vector<Candidate> more =
      find_candidates(std::move(by_contour), map, model, model_index, params, control, stats);
  candidates.insert(candidates.end(), more.begin(), more.end());
  if (params.refine) candidates = refine_to_the_end(map, model, std::move(candidates), params, control, stats);
  if (params.verification == Verification::kAllPoints) {
    candidates = compare_all_points(std::move(candidates), map, model, params, stats);
  }
  std::erase_if(candidates, [&](const Candidate& candidate) {
    return !is_allowed(map, model, model_index, params.space, {}, candidate.T_view_model);
  });
  return candidates;
}

}  // namespace binpose

#include "core/detect/search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/detect/cluster.h"
#include "core/detect/contour_votes.h"
#include "core/detect/judge.h"
#include "core/detect/places.h"
#include "core/detect/refine.h"
#include "core/detect/scene_points.h"
#include "core/detect/stage_timer.h"
#include "core/detect/vote.h"
#include "core/parallel.h"

namespace binpose {
namespace {

// Lengths as shares of the diameter D.
constexpr double kRelativeBlock = 0.042;
constexpr double kFewPoints = 1500;  // the share of the start points is of so many at least
constexpr float kClusterRadius = 0.06F;
constexpr float kCoarseTolerance = 0.04F;
constexpr float kFirstGate = 0.08F;
constexpr float kLastGate = 0.025F;

constexpr int kCoarsePoints = 80;
constexpr int kCoarseOutlineStride = 3;
constexpr int kFirstIterations = 3;
constexpr int kFirstPoints = 100;
constexpr int kFirstOutlineStride = 3;
constexpr int kMiddlePoints = 300;
constexpr float kRepeat = 0.02F;
/// Share of the least score without which no pose is refined to the end: so much that gains almost never.
constexpr double kHopeful = 1.0 / 6;
constexpr float kFinestGate = 0.015F;
constexpr int kFinestIterations = 3;
constexpr int kFinestPoints = 400;
constexpr double kContourStarts = 5;          // as many contour points start pairs, by share, as surface points do
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

Votes surface_votes(const DepthMap& map, const Model& model, const DetectParams& params, const RunControl& control,
                    DetectStats& stats) {
  const int block = std::max(1, static_cast<int>(std::lround(kRelativeBlock * model.diameter / map.pixel_size)));
  const ScenePoints scene = down_sample(map, block);
  // Of few points a larger share.
  const double share = params.start_point_share * std::max(1.0, kFewPoints / static_cast<double>(scene.points.size()));
  const std::vector<int> starts = start_points(scene, share);
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

/// Clusters of votes whose poses are allowed, most votes first.
std::vector<Candidate> cluster_votes(std::vector<PoseVote> votes, const DepthMap& map, const Model& model,
                                     int model_index, const DetectParams& params, const RunControl& control) {
  const auto diameter = static_cast<float>(model.diameter);
  const Slack voted = {kClusterRadius * model.diameter, kVotedAngle};
  keep_votes_in_regions(map, params.space, voted.distance, votes);
  ClusterOptions options;
  options.radius = kClusterRadius * diameter;
  options.most = params.cluster_limit;
  std::vector<Candidate> candidates;
  for (const PoseCluster& c : cluster(votes, options, control)) {
    Candidate candidate;
    candidate.model_index = model_index;
    candidate.T_view_model = pose_of(c, model);
    candidate.votes = c.votes;
    if (is_allowed(map, model, model_index, params.space, voted, candidate.T_view_model)) {
      candidates.push_back(candidate);
    }
  }
  return candidates;
}

/// Those that stand a coarse verification, best first.
std::vector<Candidate> stand_coarsely(std::vector<Candidate> candidates, const DepthMap& map, const Model& model,
                                      const DetectParams& params, const RunControl& control) {
  VerifyOptions coarse;
  coarse.tolerance = kCoarseTolerance * static_cast<float>(model.diameter);
  coarse.normal_cosine = 0.7F;
  coarse.most_points = kCoarsePoints;
  coarse.outline_stride = kCoarseOutlineStride;
  verify_all(map, model, coarse, control, candidates);
  std::erase_if(candidates, [&](const Candidate& c) { return c.evidence.promise() < params.least_promise; });
  sort_by(&Evidence::promise, candidates);
  return first_of_each_place(candidates, model, params.refined_per_place, params.refine_limit, 0);
}

/// Where the model may be: a list of its own for each source of votes, so that contours need not outvote surfaces or be
/// outvoted.
std::vector<Candidate> find_candidates(std::array<Votes, 2> sources, const DepthMap& map, const Model& model,
                                       int model_index, const DetectParams& params, const RunControl& control,
                                       DetectStats& stats) {
  std::array<std::vector<Candidate>, 2> found;
  {
    const StageTimer timer(stats.cluster_seconds);
    parallel_for(static_cast<int>(sources.size()), control.threads, [&](int i) {
      found[i] = cluster_votes(std::move(sources[i].votes), map, model, model_index, params, control);
    });
  }
  const StageTimer timer(stats.verify_seconds);
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    stats.cluster_count += found[i].size();
    // The paper compares each cluster with all points, and with nothing before.
    if (params.verification == Verification::kVisibleSurface) {
      found[i] = stand_coarsely(std::move(found[i]), map, model, params, control);
    }
    candidates.insert(candidates.end(), found[i].begin(), found[i].end());
  }
  return candidates;
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
  std::erase_if(candidates, [&](const Candidate& c) { return c.evidence.score() < kHopeful * params.min_score; });
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

/// The clusters by the paper's alignment error: one a place, or a few where a cloud's other points decide.
std::vector<Candidate> compare_all_points(std::vector<Candidate> candidates, const DepthMap& map, const Model& model,
                                          const DetectParams& params, DetectStats& stats) {
  const StageTimer timer(stats.verify_seconds);
  for (Candidate& candidate : candidates) {
    candidate.evidence = final_evidence(map, model, candidate.T_view_model, params);
  }
  stats.verified_count += candidates.size();
  sort_by(&Evidence::score, candidates);
  const int per_place = all_points_decide(map, params) ? params.finalists_per_place : 1;
  return first_of_each_place(candidates, model, per_place, params.finalist_limit, 0);
}

}  // namespace

std::vector<Candidate> search(const DepthMap& map, const Model& model, int model_index, const DetectParams& params,
                              const RunControl& control, DetectStats& stats) {
  std::array<Votes, 2> sources;
  {
    const StageTimer timer(stats.vote_seconds);
    const RunControl first = control.with_share_of_time(kSurfaceVotesShare);
    sources[0] = surface_votes(map, model, params, first, stats);
    const RunControl second = control.with_share_of_time(kContourVotesShare);
    if (params.use_contours) sources[1] = contour_votes(map, model, kContourStarts * params.start_point_share, second);
    if (first.past_deadline() || second.past_deadline()) stats.stop_reason = StopReason::kDeadline;
  }
  if (control.stop.stop_requested()) return {};
  for (const Votes& votes : sources) {
    stats.scene_pair_count += votes.scene_pairs;
    stats.vote_count += votes.votes.size();
  }
  std::vector<Candidate> candidates =
      find_candidates(std::move(sources), map, model, model_index, params, control, stats);
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

#include "core/detect/all_sides.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>

#include "core/detect/judge.h"
#include "core/detect/places.h"
#include "core/detect/prepare.h"
#include "core/detect/search.h"
#include "core/detect/stage_timer.h"
#include "core/detect/telling.h"
#include "core/detect/whole_cloud.h"
#include "core/geometry/hidden_surfaces.h"
#include "core/parallel.h"

namespace binpose {
namespace {

constexpr double kNearShare = 0.4;  // of the time left before a deadline
constexpr double kFarShare = 0.6;   // of what is left then
constexpr float kThinning = 0.5F;   // pixels between the points that poses are held by
constexpr float kGate = 0.015F;     // diameters

/// What search() finds from the other side, in the view's frame.
std::vector<Candidate> search_from_behind(const SensorView& view, const Model& model, int model_index,
                                          DetectParams params, const RunControl& control, DetectStats& stats) {
  for (PosePrior& prior : params.space.priors) {  // told of the sensor, which is not there
    prior.min_distance = 0;
    prior.max_distance = std::numeric_limits<double>::infinity();
  }
  const SensorView behind = from_behind(view, control);
  if (behind.points.empty()) return {};
  DepthMap map;
  {
    const StageTimer timer(stats.preprocess_seconds);
    map = prepare(behind, model, params, control);
  }
  std::vector<Candidate> candidates = search(map, model, model_index, params, control, stats);
  const Eigen::Isometry3f T_view_behind((view.T_scene_view.inverse() * map.T_scene_view).cast<float>());
  for (Candidate& candidate : candidates) candidate.T_view_model = T_view_behind * candidate.T_view_model;
  return candidates;
}

/// A candidate's pose, and the points of the whole cloud that it explains.
struct Claim {
  Eigen::Vector3f centre;
  std::vector<std::uint32_t> points;
};

/// Refines the pose on all points, unless it explains fewer then.
Claim hold(Candidate& candidate, const WholeSurface& surface, const WholeCloud& cloud, const Model& model,
           float tolerance) {
  Claim claim = {{}, surface.explained(cloud, candidate.T_view_model, tolerance)};
  const Eigen::Isometry3f T = surface.refine(cloud, candidate.T_view_model, kGate * static_cast<float>(model.diameter));
  std::vector<std::uint32_t> points = surface.explained(cloud, T, tolerance);
  if (points.size() >= claim.points.size()) {
    candidate.T_view_model = T;
    claim.points = std::move(points);
  }
  claim.centre = candidate.T_view_model * model.centre.cast<float>();
  return claim;
}

/// Whether another pose in the same place explains what a pose explains, and so much more that the pose is ruled out.
bool is_outdone(const Claim& claim, const Claim& other, float diameter) {
  if (other.points.size() <= claim.points.size()) return false;
  if ((claim.centre - other.centre).norm() > kSamePlace * diameter) return false;
  std::vector<std::uint32_t> common;
  std::set_intersection(claim.points.begin(), claim.points.end(), other.points.begin(), other.points.end(),
                        std::back_inserter(common));
  if (static_cast<float>(common.size()) < kSameSurface * static_cast<float>(claim.points.size())) return false;
  const float lead = static_cast<float>(claim.points.size()) - static_cast<float>(other.points.size());
  return likelihood_ratio(lead, kThinning) <= kRuledOut;
}

/// Holds the candidates by all points, gives up those that are outdone, and judges the others anew.
std::vector<Candidate> hold_by_all_points(std::vector<Candidate> candidates, const SensorView& view,
                                          const DepthMap& map, const Model& model, const DetectParams& params,
                                          const RunControl& control) {
  const auto diameter = static_cast<float>(model.diameter);
  const float tolerance = final_verification(map, model).tolerance;
  const WholeSurface surface(model);
  const WholeCloud cloud(view, kThinning * map.pixel_size, surface.reach(), control);
  std::vector<Claim> claims(candidates.size());
  const auto for_each = [&](const auto& use) {
    parallel_for(static_cast<int>(candidates.size()), control.threads, [&](int i) {
      if (!control.interrupted()) use(i);
    });
  };
  for_each([&](int i) { claims[i] = hold(candidates[i], surface, cloud, model, tolerance); });
  std::vector<std::uint8_t> outdone(candidates.size(), 0);
  for_each([&](int i) {
    outdone[i] = std::any_of(claims.begin(), claims.end(),
                             [&](const Claim& other) { return is_outdone(claims[i], other, diameter); });
  });
  for_each([&](int i) {
    if (outdone[i] == 0) candidates[i].evidence = final_evidence(map, model, candidates[i].T_view_model, params);
  });
  std::vector<Candidate> kept;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (outdone[i] == 0) kept.push_back(std::move(candidates[i]));
  }
  return kept;
}

}  // namespace

std::vector<Candidate> search_all_sides(const SensorView& view, const DepthMap& map, const Model& model,
                                        int model_index, const DetectParams& params, const RunControl& control,
                                        DetectStats& stats) {
  std::vector<Candidate> candidates =
      search(map, model, model_index, params, control.with_share_of_time(kNearShare), stats);
  for (Candidate& candidate :
       search_from_behind(view, model, model_index, params, control.with_share_of_time(kFarShare), stats)) {
    candidates.push_back(std::move(candidate));
  }
  {
    const StageTimer timer(stats.refine_seconds);
    candidates = hold_by_all_points(std::move(candidates), view, map, model, params, control);
  }
  std::erase_if(candidates, [&](const Candidate& candidate) {
    return !is_allowed(map, model, model_index, params.space, {}, candidate.T_view_model);
  });
  if (params.verification == Verification::kAllPoints) {
    sort_by(&Evidence::score, candidates);
    candidates = first_of_each_place(candidates, model, 1, params.finalist_limit, 0);
  }
  return candidates;
}

}  // namespace binpose

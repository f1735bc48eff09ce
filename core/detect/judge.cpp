#include "core/detect/judge.h"

#include <algorithm>
#include <utility>

namespace binpose {
namespace {

constexpr float kFinalTolerance = 0.006F;  // diameters
constexpr float kNoiseTolerance = 2.5F;    // standard deviations
constexpr float kAlignmentCutoff = 0.1F;   // diameters

}  // namespace

VerifyOptions final_verification(const DepthMap& map, const Model& model) {
  VerifyOptions options;
  options.tolerance = kFinalTolerance * static_cast<float>(model.diameter) + kNoiseTolerance * map.noise;
  return options;
}

Evidence final_evidence(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                        const DetectParams& params) {
  if (params.verification == Verification::kVisibleSurface) {
    return verify(map, model, T_view_model, final_verification(map, model));
  }
  Evidence evidence;
  evidence.area = evidence.outline_confirmed = 1;
  evidence.explained = alignment_score(map, model, T_view_model, kAlignmentCutoff * static_cast<float>(model.diameter));
  return evidence;
}

void sort_by(float (Evidence::*merit)() const, std::vector<Candidate>& candidates) {
  std::vector<std::pair<float, std::size_t>> order;  // negative: best first
  order.reserve(candidates.size());
  for (const Candidate& candidate : candidates) order.emplace_back(-(candidate.evidence.*merit)(), order.size());
  std::sort(order.begin(), order.end());
  std::vector<Candidate> sorted;
  sorted.reserve(candidates.size());
  for (const auto& [merit_below_0, i] : order) sorted.push_back(std::move(candidates[i]));
  candidates = std::move(sorted);
}

bool is_allowed(const DepthMap& map, const Model& model, int model_index, const SearchSpace& space, const Slack& slack,
                const Eigen::Isometry3f& T_view_model) {
  return allows(space, model_index, model.symmetry, model.centre, map.T_scene_view * Pose(T_view_model.cast<double>()),
                map.T_scene_view.translation(), slack);
}

}  // namespace binpose

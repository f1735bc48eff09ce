#include "core/detect/places.h"

namespace binpose {
namespace {

/// Whether two poses are turned alike, but for what refinement leaves.
bool same_turn(const Candidate& a, const Candidate& b) {
  constexpr float kLeastTrace = 2.985F;  // 7 degrees
  return a.T_view_model.linear().cwiseProduct(b.T_view_model.linear()).sum() > kLeastTrace;
}

}  // namespace

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

}  // namespace binpose

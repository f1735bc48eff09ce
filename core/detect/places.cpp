#include "core/detect/places.h"

namespace binpose {
namespace {

/// Whether two poses are turned so that they show the same, but for what refinement leaves.
bool same_turn(const Candidate& a, const Candidate& b, const Symmetry& symmetry) {
  constexpr double kLeastTrace = 2.985;  // 7 degrees
  const Eigen::Matrix3d R_a_view = a.T_view_model.linear().transpose().cast<double>();
  const Pose nearest = best_equivalent(Pose(b.T_view_model.cast<double>()), symmetry, R_a_view);
  return (R_a_view * nearest.linear()).trace() > kLeastTrace;
}

}  // namespace

bool same_pose(const Model& model, const Eigen::Isometry3f& a, const Eigen::Isometry3f& b) {
  const Pose A(a.cast<double>());
  const Pose B = best_equivalent(Pose(b.cast<double>()), model.symmetry, A.linear().transpose());
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d p = model.box_min;
    for (int k = 0; k < 3; ++k) {
      if ((corner >> k & 1) != 0) p[k] = model.box_max[k];
    }
    if ((A * p - B * p).norm() > kSamePose * model.diameter) return false;
  }
  return true;
}

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
      repeats = sq_distance < repeat * repeat && same_turn(kept[i], candidate, model.symmetry);
    }
    if (repeats || around >= per_place) continue;
    kept.push_back(candidate);
    places.push_back(place);
  }
  return kept;
}

}  // namespace binpose

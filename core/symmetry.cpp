#include "core/symmetry.h"

#include <cmath>

namespace binpose {
namespace {

constexpr double kTie = 1e-6;  // of the trace: a tie is no reason to turn a pose

/// The turn about the axis, after which trace(weighted * turn) is largest.
Pose best_turn(const Symmetry& symmetry, const Eigen::Matrix3d& weighted) {
  const Eigen::Vector3d& axis = symmetry.axis_direction;
  // Rodrigues: turn = a a^T + cos (1 - a a^T) + sin [a]x.
  const double cosine = weighted.trace() - axis.dot(weighted * axis);
  const double sine = (weighted(1, 2) - weighted(2, 1)) * axis.x() + (weighted(2, 0) - weighted(0, 2)) * axis.y() +
                      (weighted(0, 1) - weighted(1, 0)) * axis.z();
  if (std::hypot(cosine, sine) <= kTie) return Pose::Identity();
  return turn_about(symmetry.axis_point, Eigen::AngleAxisd(std::atan2(sine, cosine), axis).toRotationMatrix());
}

}  // namespace

std::vector<Pose> equivalents_of(const Pose& T_scene_model, const Symmetry& symmetry) {
  std::vector<Pose> others;
  for (std::size_t i = 1; i < symmetry.discrete.size(); ++i) others.push_back(T_scene_model * symmetry.discrete[i]);
  return others;
}

Pose best_equivalent(const Pose& T_scene_model, const Symmetry& symmetry, const Eigen::Matrix3d& weight) {
  Pose best = T_scene_model;
  double highest = (weight * best.linear()).trace();
  for (const Pose& T_model_model : symmetry.discrete) {
    Pose pose = T_scene_model * T_model_model;
    if (symmetry.has_axis) pose = pose * best_turn(symmetry, weight * pose.linear());
    const double trace = (weight * pose.linear()).trace();
    if (trace <= highest + kTie) continue;
    best = pose;
    highest = trace;
  }
  return best;
}

}  // namespace binpose

#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/pose.h"

namespace binpose {

/// Rigid motions that leave the surface where it was, within a tolerance; model frame.
struct Symmetry {
  std::vector<Pose> discrete = {Pose::Identity()};  ///< T_model_model, identity first
  bool has_axis = false;                            ///< any turn about the axis as well
  Eigen::Vector3d axis_point = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_direction = Eigen::Vector3d::UnitZ();
};

/// The other poses of the finite set that show the same surface; with an axis, each may be turned about it as well.
std::vector<Pose> equivalents_of(const Pose& T_scene_model, const Symmetry& symmetry);

/// Of all poses that show the same surface, turns about the axis among them, the one whose rotation matrix R has the
/// largest trace(weight * R). With weight = R_wanted^T that is the one turned least from R_wanted; with weight = d s^T
/// the one that brings direction d of the model nearest to direction s of the scene. Ties: the pose as it is.
Pose best_equivalent(const Pose& T_scene_model, const Symmetry& symmetry, const Eigen::Matrix3d& weight);

}  // namespace binpose

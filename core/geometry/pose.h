#pragma once

#include <Eigen/Geometry>

namespace binpose {

/// Rigid transform; `T_outer_inner` maps inner to outer coordinates, so inner letters cancel in products.
using Pose = Eigen::Isometry3d;

/// Rotation angle between two orientations, radians in [0, pi].
inline double rotation_distance(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

}  // namespace binpose

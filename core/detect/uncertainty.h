#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/detect/verify.h"

namespace binpose {

/// How well the scene determines a pose.
struct Uncertainty {
  /// Of a small motion (translation, rotation about the part's centre): metres and radians, view frame.
  Matrix6d covariance = Matrix6d::Zero();
  /// Motions of the same kind that the measurement hardly resists, such as sliding along a rod of which no end is seen:
  /// a unit vector each, if rotations count as what they do at half a diameter.
  std::vector<Twist> free_directions;
};

/// From the normal equations of the last step of refinement: points drawn to planes, outlines to contours. Independent
/// errors of the size of the residual or the noise, whichever is larger, are assumed.
Uncertainty uncertainty_of(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                           const VerifyOptions& options, double residual);

}  // namespace binpose

#pragma once

#include "core/geometry/depth_map.h"
#include "core/model.h"

namespace binpose {

/// How a pose is refined.
struct RefineOptions {
  float first_gate = 0;  ///< metres: correspondences farther apart do not count at first ...
  float last_gate = 0;   ///< ... and at the end
  int iterations = 6;
  int most_points = 200;
  int outline_stride = 1;  ///< every n-th outline point counts, n times
};

/// Projective point-to-plane ICP: each visible model point is drawn to the plane of the pixel that it falls on
/// [paper, section IV 5, by Gauss-Newton in place of a search].
Eigen::Isometry3f refine(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                         const RefineOptions& options);

/// How much the scene resists small motions of a pose: sums of J^T J over what is drawn. J: distance by motion, metres
/// by (translation, rotation about the part's centre), view frame.
struct Information {
  Matrix6d surface = Matrix6d::Zero();
  Matrix6d outline = Matrix6d::Zero();
  double surface_count = 0;  ///< surface points that are drawn
};

/// The Gauss-Newton step of a pose that solves A step = b, rotations before translations; of A the lower triangle
/// counts. Damped by that share of the translations' mean curvature, which holds what A leaves free; rotations as what
/// they do at `radius`.
Twist damped_step(Matrix6d A, const Twist& b, double damping, double radius);

/// The normal matrices of one step of refinement, from all that lies within `gate` metres.
Information information_of(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model, float gate);

}  // namespace binpose

#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "core/detect/scene_points.h"
#include "core/model.h"
#include "core/params.h"
#include "core/run_control.h"

namespace binpose {

/// A vote of one pair correspondence for a pose of the model.
struct PoseVote {
  Eigen::Vector3f centre;  ///< of the model, view frame
  float weight;
  Eigen::Quaternionf q_view_model;
};

/// The votes of a scene and what they cost.
struct Votes {
  std::vector<PoseVote> votes;
  std::uint64_t scene_pairs = 0;  ///< vector pairs looked up
};

/// The votes of several parts of a scene, in their order.
Votes concatenate(std::span<const Votes> parts);

/// Matches the scene's vector pairs with the model's [paper, section IV 2 and 3].
///
/// From each start point all pairs of the model's lengths and right angle are formed and looked up; a model pair whose
/// three normals agree in the pairs' frames within `params.normal_tolerance` votes for the whole pose
/// R = M_s M_m^T [Eq. 8] and centre C = P + M_s d_c.
/// Deterministic: votes come in the order of `starts`, on any number of threads. Ends early when `control` interrupts.
Votes vote(const ScenePoints& scene, std::span<const int> starts, const DepthMap& map, const Model& model,
           const DetectParams& params, const RunControl& control);

}  // namespace binpose

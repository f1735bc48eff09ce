#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/detect/vote.h"
#include "core/run_control.h"

namespace binpose {

/// Votes that agree on a pose.
struct PoseCluster {
  Eigen::Vector3f centre;  ///< of the model, view frame
  Eigen::Quaternionf q_view_model;
  float votes;  ///< sum of weights
};

/// How clusters are told apart and thinned.
struct ClusterOptions {
  float radius = 0;     ///< votes and clusters nearer than this, metres ...
  float angle = 0.35F;  ///< ... and this, radians, are the same pose
  int most = 0;
};

/// Clusters of whole poses, most votes first [paper, section IV 4].
///
/// Votes are binned by centre and rotation; the bins of most votes are merged with their neighbours, averaged, and kept
/// unless they repeat a stronger one. Deterministic. Empty when stopped.
std::vector<PoseCluster> cluster(std::span<const PoseVote> votes, const ClusterOptions& options,
                                 const RunControl& control = {});

}  // namespace binpose

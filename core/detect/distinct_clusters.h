#pragma once

#include <cmath>
#include <vector>

#include "core/detect/cluster.h"

namespace binpose {

/// Whether two clusters stand for one pose, within the options' radius and angle.
class SamePose {
 public:
  explicit SamePose(const ClusterOptions& options)
      : sq_radius_(options.radius * options.radius), half_angle_cosine_(std::cos(0.5F * options.angle)) {}

  bool operator()(const PoseCluster& a, const PoseCluster& b) const {
    return (a.centre - b.centre).squaredNorm() < sq_radius_ &&
           std::abs(a.q_view_model.coeffs().dot(b.q_view_model.coeffs())) > half_angle_cosine_;
  }

 private:
  float sq_radius_, half_angle_cosine_;
};

/// The strongest clusters of a list that has them first, without those that repeat a stronger one.
std::vector<PoseCluster> distinct_clusters(const std::vector<PoseCluster>& clusters, const ClusterOptions& options);

}  // namespace binpose

#pragma once

#include <functional>
#include <vector>

#include "core/detect/verify.h"

namespace binpose {

/// Which of a part's nearly alike poses the scene speaks for.
struct VariantChoice {
  Eigen::Isometry3f T_view_model = Eigen::Isometry3f::Identity();
  float confidence = 1;  ///< probability that the choice is right, against the other variants; 1 for a part without any
  std::vector<Eigen::Isometry3f> rivals;  ///< T_view_model of the variants that the scene does not rule out
};

/// Compares a pose with the poses that show nearly the same surface (Model::similar_poses), on the points where these
/// differ. Points that something hides or that were not measured say nothing. Variants near to the chosen one (see
/// same_pose()) speak for it.
///
/// @param options  as for the final verification.
/// @param allowed  whether a variant's pose may be; the pose itself may.
VariantChoice choose_variant(
    const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model, const VerifyOptions& options,
    const std::function<bool(const Eigen::Isometry3f& T_view_model)>& allowed = [](const auto&) { return true; });

}  // namespace binpose

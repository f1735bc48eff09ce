#pragma once

#include <span>
#include <vector>

#include "core/detect/verify.h"

namespace binpose {

/// The poses that explain what a pose explains, and that the scene does not rule out.
struct Rivalry {
  float odds = 0;                         ///< sum of the rivals' likelihoods, each over the pose's
  std::vector<Eigen::Isometry3f> rivals;  ///< T_view_model
};

/// Compares a pose with others found in the same place, on the points where what they show differs. A part that is
/// unmistakable as a whole may be anything but from one side: a plain wall fits several ways.
///
/// @param others   T_view_model of any poses of the model. Those elsewhere, doubles and the pose's similar ones, which
///                 choose_variant() judges, are passed over.
/// @param options  as for the final verification.
Rivalry weigh_rivals(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                     std::span<const Eigen::Isometry3f> others, const VerifyOptions& options);

}  // namespace binpose

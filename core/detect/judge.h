#pragma once

#include <vector>

#include "core/detect/rank.h"
#include "core/detect/verify.h"
#include "core/geometry/depth_map.h"
#include "core/model.h"
#include "core/params.h"
#include "core/search_space.h"

/// By what the poses of a search are told apart: which may be, what speaks for them, which is better.
namespace binpose {

/// How closely a refined pose of the model must agree with the map.
VerifyOptions final_verification(const DepthMap& map, const Model& model);

/// Whether the caller's search space allows a pose.
bool is_allowed(const DepthMap& map, const Model& model, int model_index, const SearchSpace& space, const Slack& slack,
                const Eigen::Isometry3f& T_view_model);

/// What speaks for a refined pose, in the way that the parameters ask for.
Evidence final_evidence(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                        const DetectParams& params);

/// Whether points that the map does not show decide between poses (see all_sides.h): poses that nothing has refined are
/// too rough to be compared so.
inline bool all_points_decide(const DepthMap& map, const DetectParams& params) {
  return map.hides_points && params.refine;
}

/// Most merit first; equal ones in their order.
void sort_by(float (Evidence::*merit)() const, std::vector<Candidate>& candidates);

}  // namespace binpose

#pragma once

#include <vector>

#include "core/hypothesis.h"
#include "tests/bench/paper/model_views.h"

namespace binpose::paper {

/// What both methods of PCL end with: each pose is aligned to the scene by ICP (point to plane, the view's surface),
/// judged by the share of the view's points that the scene has too, and dropped where a better one explains the same
/// points.
///
/// @param diameter  of the part, metres.
/// @return          best first; score = that share.
std::vector<PoseHypothesis> pose_list(const std::vector<Pose>& T_scene_models, const Cloud::Ptr& scene,
                                      const std::vector<ModelView>& views, double diameter);

}  // namespace binpose::paper

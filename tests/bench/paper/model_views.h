#pragma once

#include <vector>

#include "core/geometry/pose.h"
#include "tests/bench/paper/oriented_cloud.h"
#include "tests/support/bin_scene.h"

namespace binpose::paper {

/// What a scanner would see of a part from one side; model frame.
struct ModelView {
  Eigen::Vector3d towards_viewer;  ///< unit
  Cloud::Ptr surface;
};

/// Views from all around, scanned without noise from `distance` and treated as scenes are (oriented_cloud), so that a
/// descriptor reaches over the same surface here and there.
std::vector<ModelView> model_views(const testing::ScenePart& part, int count, double distance, double spacing);

/// Index of the view that shows what the sensor at the origin sees of the part at a pose.
int nearest_view(const std::vector<ModelView>& views, const Pose& T_scene_model);

}  // namespace binpose::paper

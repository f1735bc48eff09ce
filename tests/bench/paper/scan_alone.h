#pragma once

#include "core/geometry/mesh.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/pose.h"

namespace binpose::paper {

/// What a perfect sensor at the origin sees of one part and nothing else: an organised cloud, NaN where no surface is.
///
/// @param spacing  between neighbouring points at the middle of the part, metres.
PointCloud scan_alone(const Mesh& part, const Pose& T_scene_model, double spacing);

}  // namespace binpose::paper

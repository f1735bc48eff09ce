#pragma once

#include <vector>

#include "core/detect/rank.h"
#include "core/geometry/depth_map.h"
#include "core/hypothesis.h"
#include "core/params.h"
#include "core/run_control.h"

namespace binpose {

/// search() of a cloud that holds what its sensor can't have seen: merged from several views, or taken of all sides.
/// Poses are also looked for from behind, held by all points, and those given up that another outdoes on these.
///
/// @param map  of the view, with normals and contours, for which all_points_decide(); what is answered is judged on it,
///             as by search().
std::vector<Candidate> search_all_sides(const SensorView& view, const DepthMap& map, const Model& model,
                                        int model_index, const DetectParams& params, const RunControl& control,
                                        DetectStats& stats);

}  // namespace binpose

#pragma once

#include <vector>

#include "core/detect/rank.h"
#include "core/geometry/depth_map.h"
#include "core/hypothesis.h"
#include "core/model.h"
#include "core/params.h"
#include "core/run_control.h"

namespace binpose {

/// Where one model may be: votes of both sources, clusters, coarse verification, refinement, final verification.
/// Unranked, with doubles. Counts and times are added to `stats`. Ends early when `control` interrupts.
std::vector<Candidate> search(const DepthMap& map, const Model& model, int model_index, const DetectParams& params,
                              const RunControl& control, DetectStats& stats);

}  // namespace binpose

#pragma once

#include <span>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"
#include "core/hypothesis.h"
#include "core/model.h"
#include "core/params.h"
#include "core/run_control.h"

namespace binpose {

/// Finds the parts in a cloud [paper, section IV].
///
/// @param cloud   scene frame, metres; points of NaN are no measurements.
/// @param models  what to look for; not null, at least one. PoseHypothesis::model_index points into it.
/// @return        hypotheses, best first; none is a valid answer, `warnings` then says why.
/// Deterministic: equal input gives a bit-identical answer on any number of threads (but for the times, and unless
/// the deadline cut the search). Errors: INVALID_ARGUMENT (parameters, a cloud that contradicts itself or holds no
/// measurement), CANCELLED.
absl::StatusOr<DetectResult> detect(const PointCloud& cloud, std::span<const Model* const> models,
                                    const DetectParams& params, const RunControl& control);

}  // namespace binpose

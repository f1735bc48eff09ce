#pragma once

#include "core/detect/rank.h"
#include "core/hypothesis.h"
#include "core/params.h"

namespace binpose {

/// What is answered of a ranked candidate: its pose in the scene, turned to the symmetric equivalent that the caller
/// would rather have, with all that is known of it.
PoseHypothesis describe(const Candidate& candidate, const DepthMap& map, const Model& model,
                        const VerifyOptions& verification, const DetectParams& params);

}  // namespace binpose

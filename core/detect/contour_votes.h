#pragma once

#include "core/detect/vote.h"

namespace binpose {

/// Matches pairs of the scene's contour points with the model's; each match votes for a whole pose.
///
/// Finds parts of which only a flat side shows: there all vector pairs look alike, but the rim does not.
/// @param start_share  share of the contour points that pairs start from.
/// Deterministic on any number of threads. Ends early when `control` interrupts.
Votes contour_votes(const DepthMap& map, const Model& model, double start_share, const RunControl& control);

}  // namespace binpose

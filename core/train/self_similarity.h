#pragma once

#include <vector>

#include "core/model.h"
#include "core/run_control.h"

namespace binpose {

/// The turns that bring a part onto itself, wholly or nearly.
struct SelfSimilarity {
  Symmetry symmetry;          ///< no point of the surface ends up off it by more than a sensor resolves
  std::vector<Pose> similar;  ///< T_model_model, symmetry taken out: most of the surface ends up on itself
};

/// Searches all turns about the middle of the surface.
///
/// @param dense     the surface, spaced at most 0.008 diameters.
/// @param surface   evenly spaced, progressive points of it.
/// @param diameter  metres.
/// Deterministic. Only the identity when `control` interrupts.
/// Cost: some 20 000 turns of 80 points; below half a second.
SelfSimilarity find_self_similarity(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface,
                                    double diameter, const RunControl& control);

/// The points of `dense` that at least one of the turns takes off the surface: what tells a pose from its likes. Part
/// of them when `control` interrupts.
std::vector<SurfacePoint> telling_points(const std::vector<SurfacePoint>& dense, const std::vector<Pose>& similar,
                                         double diameter, const RunControl& control = {});

}  // namespace binpose

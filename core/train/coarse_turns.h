#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/run_control.h"
#include "core/vector_pair.h"

namespace binpose {

/// A turn of the part about its own frame, T_model_model, and the share of the surface that it leaves on itself.
struct RatedTurn {
  Eigen::Isometry3f T;
  double share;
};

/// How near to the surface a coarse turn may leave a point that counts as on it, as a share of the diameter.
inline constexpr double kCoarseReach = 0.1;

/// Whether two turns move no point at `radius` apart by `most` or more, metres; their shifts do not count.
bool same_turn(const Eigen::Isometry3f& a, const Eigen::Isometry3f& b, float radius, float most);

/// Turns about the middle that bring the first points near to the surface, best first, one of each kind: some hundreds
/// out of a grid of 10 degrees. Their share grows with how near the points come. None when `control` interrupts.
///
/// @param surface   evenly spaced, progressive.
/// @param diameter  metres.
std::vector<RatedTurn> coarse_turns(const std::vector<SurfacePoint>& surface, const Eigen::Vector3f& middle,
                                    float diameter, const RunControl& control);

}  // namespace binpose

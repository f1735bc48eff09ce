#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/geometry/view_sphere.h"
#include "core/run_control.h"
#include "core/vector_pair.h"

namespace binpose {

/// Which surface points each viewpoint sees: the delta(p, o_k) of [Eq. 5].
///
/// The dense points are projected in parallel onto a plane across the view; a point is seen when it is nearest in its
/// cell, to within the depth that its slope spans there, and its normal is at most `kGrazingAngle` off the view, as
/// sensors get no echo from steeper ones.
///
/// @param dense       the surface, spaced at most a third of `cell`.
/// @param points      what to judge; any subset of the surface.
/// @param viewpoints  unit directions from the part to the viewer.
/// @param cell        size of a projection cell, metres.
/// @return            per point one bit per viewpoint; empty masks when `control` interrupts.
/// Deterministic on any number of threads.
std::vector<ViewMask> visibility(std::span<const SurfacePoint> dense, std::span<const SurfacePoint> points,
                                 std::span<const Eigen::Vector3f> viewpoints, double cell, const RunControl& control);

/// Obs(p) [Eq. 5]: share of the `view_count` viewpoints that see the point, in [0, 1].
double observability(const ViewMask& point, int view_count);

/// Obs(v) [Eq. 6]: share of the viewpoints from which P, Q1 and Q2 are seen at once, in [0, 1].
/// Cost: view_count / 64 word operations.
double observability(const ViewMask& p, const ViewMask& q1, const ViewMask& q2, int view_count);

/// Per point: whether its normal points into the part, as its shell is clearly seen from the other side more. A shell
/// that is seen from both sides or from none is judged like the whole mesh: a surface without a back, or an inner face,
/// keeps its normals if the mesh at large does.
///
/// @param dense     the surface, spaced at most a third of `cell`.
/// @param shell_of  per point: a number that the points of one shell share; their normals agree.
/// Judged from fewer views when `control` interrupts.
std::vector<bool> seen_from_behind(std::span<const SurfacePoint> dense, std::span<const std::uint32_t> shell_of,
                                   std::span<const Eigen::Vector3f> viewpoints, double cell,
                                   const RunControl& control = {});

}  // namespace binpose

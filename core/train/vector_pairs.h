#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/params.h"
#include "core/run_control.h"
#include "core/vector_pair.h"

namespace binpose {

/// Largest deviation of a pair's vectors from the right angle that still counts, as a cosine.
inline constexpr float kRightAngleCosine = 0.07F;

/// All vector pairs of the given lengths and right angle [paper, section II B].
///
/// @param points     at most 65535 surface points of the model.
/// @param lengths    |P Q1| and |P Q2| as shares of `diameter`, each within `relative_tolerance`.
/// @param scale      written to each pair.
/// @return           in the order of P, Q1, Q2; empty when `control` interrupts.
std::vector<VectorPair> vector_pairs(std::span<const SurfacePoint> points, const PairLengths& lengths,
                                     double relative_tolerance, double diameter, int scale, const RunControl& control);

/// Ph of each pair [Eq. 2-4]: the share of all pairs that have its feature f(s_p, s_q1, s_q2). 1 - Ph is the
/// distinctiveness. In the order of `pairs`, each in (0, 1]; of no use when `control` interrupts.
///
/// @param weights  how much each pair counts, positive, in the order of `pairs`; empty: all alike, as in the paper.
std::vector<double> occurrence_probability(std::span<const SurfacePoint> points, std::span<const VectorPair> pairs,
                                           const FeatureBins& bins, const RunControl& control = {},
                                           std::span<const double> weights = {});

}  // namespace binpose

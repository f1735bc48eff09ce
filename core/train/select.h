#pragma once

#include <span>
#include <vector>

#include "core/params.h"
#include "core/run_control.h"

namespace binpose {

/// What a pair is worth for matching: the integrated value I(v) [Eq. 7] or one of its rivals.
///
/// @param obs  Obs(v) [Eq. 6], in [0, 1].
/// @param ph   Ph(v) [Eq. 4], in (0, 1].
double pair_value(double obs, double ph, const TrainParams& params);

/// Indices of the `count` pairs of the highest value, best first; equal values in the order of the list. None when
/// `control` interrupts.
std::vector<std::size_t> best_pairs(std::span<const double> values, std::size_t count, const RunControl& control = {});

}  // namespace binpose

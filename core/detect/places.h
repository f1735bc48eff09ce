#pragma once

#include <vector>

#include "core/detect/rank.h"
#include "core/model.h"

namespace binpose {

/// Diameters within which poses compete for one place.
inline constexpr float kNeighbourhood = 0.25F;

/// The first candidates of each neighbourhood, without those that repeat an earlier one within `repeat` metres: turned
/// as it is, or by a symmetry of the model.
std::vector<Candidate> first_of_each_place(const std::vector<Candidate>& candidates, const Model& model, int per_place,
                                           int most, float repeat);

}  // namespace binpose

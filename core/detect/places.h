#pragma once

#include <vector>

#include "core/detect/rank.h"
#include "core/model.h"

namespace binpose {

/// Diameters within which poses compete for one place.
inline constexpr float kNeighbourhood = 0.25F;

/// Diameters by which poses may move every corner of the model's box apart and still be one.
inline constexpr double kSamePose = 0.1;

/// Whether two poses are one, near enough, be it by a symmetry of the model.
bool same_pose(const Model& model, const Eigen::Isometry3f& a, const Eigen::Isometry3f& b);

/// The first candidates of each neighbourhood, without those that repeat an earlier one within `repeat` metres: turned
/// as it is, or by a symmetry of the model.
std::vector<Candidate> first_of_each_place(const std::vector<Candidate>& candidates, const Model& model, int per_place,
                                           int most, float repeat);

}  // namespace binpose

#pragma once

#include <span>
#include <vector>

#include "core/detect/verify.h"
#include "core/geometry/depth_map.h"
#include "core/model.h"

namespace binpose {

/// A refined pose with what speaks for it.
struct Candidate {
  int model_index = 0;
  Eigen::Isometry3f T_view_model = Eigen::Isometry3f::Identity();
  float votes = 0;
  Evidence evidence;
  std::vector<int> occluded_by;  ///< indices into the ranked list, ascending; set by rank()
};

/// The best candidates, best first, without doubles.
///
/// An accepted pose owns the pixels that it explains. The rest are judged anew without these, so that a second pose of
/// the same part loses its evidence, whatever the part's symmetry. Deterministic: equal scores in the order of the
/// list.
///
/// @param options    final verification of each model's candidates, by model index.
/// @param min_score  candidates that score less, at first or for want of free pixels, are dropped.
std::vector<Candidate> rank(const DepthMap& map, std::span<const Model* const> models,
                            std::span<const VerifyOptions> options, std::vector<Candidate> candidates,
                            double min_score);

}  // namespace binpose

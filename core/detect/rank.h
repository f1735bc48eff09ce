#pragma once

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

#include "core/detect/variants.h"
#include "core/detect/verify.h"
#include "core/geometry/depth_map.h"
#include "core/model.h"
#include "core/run_control.h"

namespace binpose {

/// A refined pose with what speaks for it.
struct Candidate {
  int model_index = 0;
  Eigen::Isometry3f T_view_model = Eigen::Isometry3f::Identity();
  float votes = 0;
  Evidence evidence;
  float confidence = 1;                   ///< that the choice is right
  bool accept_rivals = false;             ///< whether a rival would do as well
  std::vector<Eigen::Isometry3f> rivals;  ///< T_view_model of poses nearly alike from here, not ruled out
  std::vector<int> occluded_by;           ///< indices into the ranked list, ascending; set by rank()

  /// The evidence, times the confidence that none of the rivals is the right one if that matters.
  float score() const { return accept_rivals ? evidence.score() : evidence.score() * confidence; }
  /// How surely the part is there: the score, less where less shows of it than of the part on average. Edges alone are
  /// weak proof: the rim of a bin resembles many a part seen edge-on. Which of its poses is right does not matter to
  /// it.
  float presence() const { return evidence.strict_score() * std::min(1.0F, evidence.area); }
  /// The same, an outline that a coarse scan does not confirm not held against it.
  float lenient_presence() const { return evidence.score() * std::min(1.0F, evidence.area); }
};

/// Candidates without doubles, best first.
struct Ranking {
  std::vector<Candidate> accepted;  ///< those that score enough
  std::vector<Candidate> rejected;  ///< the best of the others, without `occluded_by`
  int ambiguous_places = 0;         ///< where a part surely is that was not accepted because too many rivals are left
  float best_doubtful = 0;          ///< best presence() of the models that only the presence score kept out; 0 = none
};

/// How candidates are ranked.
struct RankOptions {
  std::span<const VerifyOptions> verification = {};  ///< the final one of each model's candidates, by model index
  double min_score = 0;           ///< candidates that score less, at first or for want of free pixels, are not accepted
  double presence_score = 0;      ///< nor are those of a model of which none has at least this presence()
  bool accept_ambiguous = false;  ///< whether a candidate's score is its evidence, be its rivals as many as they may
  int max_rejected = 0;  ///< of those, so many are ranked on among themselves; what is accepted does not depend on it
  /// Whether a nearly alike pose of a candidate may be.
  std::function<bool(int model_index, const Eigen::Isometry3f& T_view_model)> allowed = [](int, const auto&) {
    return true;
  };
};

/// Ranks candidates. An accepted pose owns the pixels that it explains. The rest are judged anew without these, so that
/// a second pose of the same part loses its evidence, whatever the part's symmetry. Deterministic: equal scores in the
/// order of the list.
///
/// Ends early when the caller of `control` cancels; past a deadline what was found so far is still ranked.
Ranking rank(const DepthMap& map, std::span<const Model* const> models, std::vector<Candidate> candidates,
             const RankOptions& options, const RunControl& control = {});

}  // namespace binpose

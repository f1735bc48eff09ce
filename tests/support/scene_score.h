#pragma once

#include <span>
#include <vector>

#include "core/hypothesis.h"
#include "tests/support/bin_scene.h"

namespace binpose::testing {

/// Counts over one or many scenes; `+=` adds them up.
struct SceneScore {
  int scenes = 0;
  int best_right = 0;  ///< scenes whose best-ranked pose fits some instance
  int instances = 0;   ///< of visibility >= 0.5
  int hits = 0;        ///< of these, found
  int wrong = 0;       ///< hypotheses that fit nothing, or only instances that better ones took

  double recall() const { return instances > 0 ? static_cast<double>(hits) / instances : 1; }
  double precision() const { return hits + wrong > 0 ? static_cast<double>(hits) / (hits + wrong) : 1; }
  SceneScore& operator+=(const SceneScore& other);
};

/// Tells right poses from wrong ones: a pose is right when no point of the surface is more than 10 % of the diameter
/// from where it should be, for the best of the part's symmetries (the maximum symmetry-aware surface distance).
class PoseJudge {
 public:
  explicit PoseJudge(const ScenePart& part);

  /// Maximum symmetry-aware surface distance, metres.
  double surface_distance(const Pose& estimate, const Pose& truth) const;
  bool right(const Pose& estimate, const Pose& truth) const;

  /// Matches hypotheses, best first, each with its closest free instance. One that fits an instance of visibility below
  /// 0.5 is neither right nor wrong.
  /// @param verdicts  if given, receives per hypothesis 1 = hit, 0 = ignored, -1 = wrong.
  SceneScore score(std::span<const PoseHypothesis> hypotheses, std::span<const SceneInstance> instances,
                   std::vector<int>* verdicts = nullptr) const;

 private:
  double diameter_;
  std::vector<Eigen::Vector3d> points_;              ///< outermost vertices
  std::vector<std::vector<Eigen::Vector3d>> moved_;  ///< the points under each symmetry
};

}  // namespace binpose::testing

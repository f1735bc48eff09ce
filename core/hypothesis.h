#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/pose.h"

namespace binpose {

/// One part found in a scene.
struct PoseHypothesis {
  int model_index = 0;  ///< into the models that were searched for
  Pose T_scene_model = Pose::Identity();
  double score = 0;                 ///< [0, 1]; see detect/verify.h
  double visible_fraction = 0;      ///< of the surface that the view could show, the share that nothing hides
  double explained_fraction = 0;    ///< of the surface that should be seen, the share that the scene explains
  double violated_fraction = 0;     ///< of the surface that should be seen, the share that the sensor saw through
  double unexplained_fraction = 0;  ///< of the surface that should be seen, the share where something else lies
  double outline_confirmed = 0;  ///< of the outline that should be seen, the share where the scene's surface ends too,
                                 ///< as far as was measured
  double outline_contradicted = 0;  ///< ... the share where it does not, or where there is none
  double explained_area = 0;        ///< explained surface across the view, over the part's mean over all views
  double confidence = 1;            ///< that this pose is right and not one that shows nearly the same from this side
  std::vector<Pose> variants;       ///< T_scene_model of nearly alike poses that the scene can't rule out; else empty
  std::vector<Pose> equivalents;    ///< T_scene_model that show the same, where DetectParams::list_equivalents asks
  /// Of a small motion T' = (translation, rotation about the model's origin) * T_scene_model, metres and radians, scene
  /// axes.
  Matrix6d covariance = Matrix6d::Zero();
  /// Motions of that kind that the scene hardly resists; see detect/uncertainty.h.
  std::vector<Twist> free_directions;
  double residual = 0;           ///< root mean square distance of the explained surface, metres
  double votes = 0;              ///< weighted votes of the vector pairs
  std::vector<int> occluded_by;  ///< indices into the result: the parts that hide some of this one, ascending
};

enum class StopReason { kComplete, kDeadline, kMaxResults };

/// What a search did; counts are sums over the models, times are seconds.
struct DetectStats {
  double total_seconds = 0;
  double preprocess_seconds = 0;
  double vote_seconds = 0;
  double cluster_seconds = 0;
  double refine_seconds = 0;
  double verify_seconds = 0;
  double rank_seconds = 0;
  std::uint64_t point_count = 0;        ///< measured points of the cloud
  std::uint64_t start_point_count = 0;  ///< points that pairs started from
  std::uint64_t scene_pair_count = 0;   ///< vector pairs looked up
  std::uint64_t vote_count = 0;
  std::uint64_t cluster_count = 0;
  std::uint64_t verified_count = 0;  ///< hypotheses refined and verified
  StopReason stop_reason = StopReason::kComplete;
};

/// Hypotheses, best first, and how they came about.
struct DetectResult {
  std::vector<PoseHypothesis> hypotheses;
  std::vector<PoseHypothesis> rejected;  ///< scored too little; as many as DetectParams::max_rejected asks for
  DetectStats stats;
  std::vector<std::string> warnings;  ///< what limited the result or is odd about the cloud
};

}  // namespace binpose

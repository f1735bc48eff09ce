#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "core/search_space.h"

/// Every parameter of training and detection with its default, its unit and its range. A default is written here only.
namespace binpose {

constexpr double kDegree = 0.017453292519943295;  ///< radians

/// How vector pairs are ranked before the best are kept.
enum class PairSelection {
  kDistinctiveness,  ///< 1 - Ph [Eq. 4]: rare features first
  kObservability,    ///< Obs [Eq. 6]: pairs seen from many viewpoints first
  kIntegration,      ///< w1 Obs + w2 (1 - Ph) [Eq. 7]
  /// Obs / sqrt(Ph), Ph among what is seen: expected true votes over the noise of the false ones. A scene has few pairs
  /// of inner surfaces, so that a part's flat outer sides are far more frequent there than among the model's pairs.
  kSignalToNoise,
};

/// Lengths |P Q1| and |P Q2| of the two vectors of a pair, as shares of the diameter, [0.05, 0.9].
struct PairLengths {
  double relative_q1 = 0.30;
  double relative_q2 = 0.22;

  bool operator==(const PairLengths&) const = default;
};

/// How a mesh becomes a model. `relative_*`: share of the part's diameter.
struct TrainParams {
  double relative_sampling = 0.045;                                      ///< spacing of the pair points, [0.02, 0.1]
  std::vector<PairLengths> pair_lengths = {{0.30, 0.22}, {0.22, 0.12}};  ///< 1 to 4 of them
  double relative_length_tolerance = 0.02;                               ///< [0.001, 0.05]
  double bin_width = 12 * kDegree;                                       ///< of a feature angle, [4, 45] degrees
  int viewpoint_count = 500;                                             ///< K of [Eq. 5, 6], [16, 4096]
  PairSelection selection = PairSelection::kSignalToNoise;
  double pairs_per_point = 6.0;         ///< N as a multiple of the model points, [0.001, 20]
  double observability_weight = 1.0;    ///< w1 of [Eq. 7], [0, 1000]
  double distinctiveness_weight = 1.0;  ///< w2 of [Eq. 7], [0, 1000]

  /// The paper's settings: one pair of lengths, N = 10 % of the model points, 1:1 integration.
  static TrainParams paper();

  bool operator==(const TrainParams&) const = default;
};

/// How a pose is judged.
enum class Verification {
  kVisibleSurface,  ///< what the sensor should see from there: surface, free space, outline
  kAllPoints,       ///< the paper's alignment error over all model points, seen or not [section IV 5]
};

/// How a cloud is searched.
struct DetectParams {
  double min_score = 0.3;  ///< [0, 1]
  /// What one pose of a model must reach for any of its poses to count, [0, 1]: its score, whatever its rivals, times
  /// its explained area where that is below 1, and less in a coarse scan that does not confirm its outline. A bin that
  /// holds a part nearly always shows one of them well; where all poses are doubtful, the part is not there, and where
  /// none reaches a seventh more, only those count that reach it themselves.
  double presence_score = 0.45;
  /// Whether poses are answered whose variants the scene does not rule out, as of a disc whose mark is hidden. A score
  /// then says how surely the part is there in this pose or a variant of it; else, how surely it is in this very pose.
  bool accept_ambiguous = false;
  int max_results = 100;  ///< [1, 1000]
  int max_rejected = 0;   ///< best poses that scored too little, answered apart, [0, 1000]
  /// Share of the down-sampled points (of 1500 where there are fewer) that pairs start from, [0.001, 1]; five times the
  /// share of contour points.
  double start_point_share = 0.2;
  double normal_tolerance = 10 * kDegree;  ///< gate on pair normals, [2, 180] degrees; 180 = none
  bool remove_support_plane = true;
  SearchSpace space;              ///< what is known of where parts are
  bool list_equivalents = false;  ///< whether symmetric equivalents are answered too
  /// Of symmetric equivalents the one turned least from this is answered: q_scene_model, unit.
  std::optional<Eigen::Quaterniond> reference_orientation;

  // Effort.
  int cluster_limit = 700;      ///< clusters of votes that are verified, most votes first, per source, [1, 100000]
  double least_promise = 0.5;   ///< Evidence::promise() of a pose that is refined, [-2, 2]
  int refine_limit = 200;       ///< poses that are refined, per source, [1, 100000]
  int refined_per_place = 5;    ///< [1, 1000]
  int finalist_limit = 150;     ///< of those, poses that are refined to the end, [1, 100000]
  int finalists_per_place = 4;  ///< [1, 1000]

  // Method.
  bool use_contours = true;  ///< contour pairs find poses, and rims hold them in refinement
  bool refine = true;        ///< point-to-plane, after clustering
  Verification verification = Verification::kVisibleSurface;

  /// The paper's settings: no gate, few clusters, no contours, no refinement, all model points compared.
  static DetectParams paper();
  /// Fewer starts, votes and poses: for parts that show well.
  static DetectParams fast();
  /// More of all: for parts that are hidden or seen badly, where time matters less.
  static DetectParams thorough();

  bool operator==(const DetectParams&) const = default;
};

/// OK, or INVALID_ARGUMENT with a sentence that names field, value and range.
absl::Status validate(const TrainParams& params);
absl::Status validate(const DetectParams& params);

}  // namespace binpose

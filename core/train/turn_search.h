#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/geometry/cell_index.h"
#include "core/run_control.h"
#include "core/train/coarse_turns.h"
#include "core/vector_pair.h"

namespace binpose {

/// A point this near to the surface is on it, as a share of the diameter.
inline constexpr double kOnSurface = 0.014;
/// Share of the surface that a turn must leave on itself to count as symmetry: the rest is rounding of the mesh.
inline constexpr double kSameShare = 0.995;
/// ... to show nearly the same.
inline constexpr double kSimilarShare = 0.75;
/// Likes of a part that are told apart, at most.
inline constexpr std::size_t kMostSimilar = 64;

/// Searches and judges turns of a part; holds what every judgement needs. Refers to all that it is made of.
class TurnSearch {
 public:
  /// See find_self_similarity().
  TurnSearch(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface, double diameter,
             const RunControl& control);

  /// All turns that leave most of the surface on itself, the identity first, then best first.
  std::vector<RatedTurn> find() const;

  /// Share of the surface that a turn leaves on itself.
  double share(const Eigen::Isometry3f& T) const { return share(T, kJudgedPoints); }

  float radius() const { return diameter_ / 2; }
  /// Turns that move no corner of the box farther apart are one, metres.
  float same_pose() const;
  const Eigen::Vector3f& middle() const { return middle_; }

 private:
  static constexpr std::size_t kJudgedPoints = 4000;

  float first_gate() const;
  float second_gate() const;

  /// Of the first points of the surface the share that a turn leaves on it.
  double share(const Eigen::Isometry3f& T, std::size_t most) const;

  /// Point-to-plane steps that draw the first points of the surface, turned, to a target.
  ///
  /// @param index  of the target.
  /// @param gate   how far a point may be from it, metres.
  Eigen::Isometry3f settle(const CellIndex& index, const std::vector<SurfacePoint>& target, std::size_t most,
                           float gate, Eigen::Isometry3f T) const;

  /// The turns with the symmetric ones drawn to where they fit best: a small socket or key leaves a whole range of
  /// angles on the surface, to within the tolerance, and what was found lies anywhere in it.
  std::vector<RatedTurn> polished(std::vector<RatedTurn> turns) const;

  /// Appends a turn that leaves enough of the surface on itself, unless it is known.
  void add(const Eigen::Isometry3f& T, std::vector<RatedTurn>& found) const;

  /// Leaves out turns on the flank of a better one: halfway to it the part fits no worse.
  std::vector<RatedTurn> peaks(const std::vector<RatedTurn>& turns) const;

  /// Adds the products of turns: teeth that stand closer than the coarse search's step.
  void complete(std::vector<RatedTurn>& found) const;

  const std::vector<SurfacePoint>& dense_;
  const std::vector<SurfacePoint>& surface_;
  const RunControl& control_;
  float diameter_, on_surface_;
  std::vector<SurfacePoint> sparse_;  ///< evenly spread all the same
  CellIndex sparsely_by_place_, by_place_, finely_by_place_;
  Eigen::Vector3f middle_;
};

}  // namespace binpose

#include "core/train/self_similarity.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/geometry/cell_index.h"
#include "core/geometry/pose.h"
#include "core/train/coarse_turns.h"

namespace binpose {
namespace {

// Lengths as shares of the diameter.
constexpr double kFirstGate = 0.7 * kCoarseReach;
constexpr double kSecondGate = kFirstGate / 2;
constexpr double kOnSurface = 0.014;  // a point this near to the surface is on it
constexpr double kSameTurn = 0.06;    // turns that move no corner of the box farther apart are one

constexpr int kRefinements = 4;  // at each gate
constexpr std::size_t kRefinePoints = 150;
constexpr std::size_t kCoarseTargets = 1500;
constexpr std::size_t kPolishPoints = 1000;
constexpr std::size_t kGlancedPoints = 400;  // a first judgement
constexpr std::size_t kJudgedPoints = 4000;
constexpr double kSimilarShare = 0.75;  // of the surface that a turn must leave on itself
constexpr double kSameShare = 0.995;    // ... to count as symmetry: the rest is rounding of the mesh
constexpr std::size_t kMostSimilar = 64;
constexpr float kFlank = 0.45F;  // radians, about 26 degrees, within which a turn may lie on another's flank
constexpr double kDip = 0.002;   // of the share, between two peaks
constexpr int kAxisProbes = 9;

/// Share of the points that a turn leaves on the surface.
double share_on_surface(const CellIndex& index, const std::vector<SurfacePoint>& points, const Eigen::Isometry3f& T,
                        std::size_t most, float tolerance, const RunControl& control) {
  const std::size_t count = std::min(most, points.size());
  std::size_t on = 0;
  for (std::size_t i = 0; i < count && !control.interrupted_at(i); ++i) {
    on += index.near({T * points[i].position, T.linear() * points[i].normal}, tolerance);
  }
  return static_cast<double>(on) / static_cast<double>(count);
}

/// Half of the way from one turn to another.
Eigen::Isometry3f halfway(const Eigen::Isometry3f& a, const Eigen::Isometry3f& b, const Eigen::Vector3f& middle) {
  Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
  T.linear() = Eigen::Quaternionf(a.linear()).slerp(0.5F, Eigen::Quaternionf(b.linear())).toRotationMatrix();
  T.translation() = (a * middle + b * middle) / 2 - T.linear() * middle;
  return T;
}

/// Whether two turns lay an axis on the same line, the same way round.
bool same_axis(const Eigen::Isometry3f& a, const Eigen::Isometry3f& b, const Symmetry& symmetry, float radius,
               float most) {
  const Eigen::Vector3f direction = symmetry.axis_direction.cast<float>(), point = symmetry.axis_point.cast<float>();
  return radius * (a.linear() * direction - b.linear() * direction).norm() < most &&
         (a * point - b * point).norm() < most;
}

/// The axis of a turn: its direction and the point of it that is nearest to the middle.
std::pair<Eigen::Vector3f, Eigen::Vector3f> axis_of(const Eigen::Isometry3f& T, const Eigen::Vector3f& middle) {
  const Eigen::AngleAxisf turn(T.linear());
  const Eigen::Vector3f shift = T * middle - middle;
  const Eigen::Vector3f across = shift - turn.axis() * turn.axis().dot(shift);
  const float half = turn.angle() / 2;
  return {turn.axis(), middle + across / 2 + turn.axis().cross(across) / (2 * std::tan(half))};
}

/// Searches and judges turns; holds what every judgement needs.
class TurnSearch {
 public:
  TurnSearch(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface, double diameter,
             const RunControl& control)
      : dense_(dense),
        surface_(surface),
        control_(control),
        diameter_(static_cast<float>(diameter)),
        on_surface_(static_cast<float>(kOnSurface) * diameter_),
        sparse_(surface.begin(), surface.begin() + std::min<std::ptrdiff_t>(kCoarseTargets, std::ssize(surface))),
        sparsely_by_place_(sparse_, first_gate()),
        by_place_(surface, second_gate()),
        finely_by_place_(dense, on_surface_) {
    sparsely_by_place_.insert_all(control);
    by_place_.insert_all(control);
    finely_by_place_.insert_all(control);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const SurfacePoint& point : dense) sum += point.position.cast<double>();
    middle_ = (sum / static_cast<double>(dense.size())).cast<float>();
  }

  /// All turns that leave most of the surface on itself, the identity first, then best first.
  std::vector<RatedTurn> find() const {
    std::vector<RatedTurn> found = {{Eigen::Isometry3f::Identity(), 1}};
    std::vector<Eigen::Isometry3f> settled;
    for (const RatedTurn& coarse : coarse_turns(surface_, middle_, diameter_, control_)) {
      if (control_.interrupted()) break;
      const Eigen::Isometry3f near_by = settle(sparsely_by_place_, sparse_, kRefinePoints, first_gate(), coarse.T);
      const bool repeats = std::any_of(settled.begin(), settled.end(), [&](const Eigen::Isometry3f& other) {
        return same_turn(other, near_by, radius(), same_pose() / 3);
      });
      if (repeats) continue;
      settled.push_back(near_by);
      add(settle(by_place_, surface_, kRefinePoints, second_gate(), near_by), found);
    }
    complete(found);
    std::stable_sort(found.begin() + 1, found.end(),
                     [](const RatedTurn& a, const RatedTurn& b) { return a.share > b.share; });
    return polished(peaks(found));
  }

  /// Whether the part is one of revolution about the axis of a turn.
  bool revolves_about_axis_of(const Eigen::Isometry3f& T) const {
    const auto [direction, point] = axis_of(T, middle_);
    for (int i = 1; i <= kAxisProbes; ++i) {
      const float angle = static_cast<float>(2 * std::numbers::pi * std::fmod(0.6180339887 * i, 1.0));
      const Eigen::Isometry3f turn = turn_about(point, Eigen::AngleAxisf(angle, direction).toRotationMatrix());
      if (control_.interrupted() || share(turn, kJudgedPoints) < kSameShare) return false;
    }
    return true;
  }

  float radius() const { return diameter_ / 2; }
  float same_pose() const { return static_cast<float>(kSameTurn) * diameter_; }
  const Eigen::Vector3f& middle() const { return middle_; }

 private:
  float first_gate() const { return static_cast<float>(kFirstGate) * diameter_; }
  float second_gate() const { return static_cast<float>(kSecondGate) * diameter_; }

  double share(const Eigen::Isometry3f& T, std::size_t most) const {
    return share_on_surface(finely_by_place_, surface_, T, most, on_surface_, control_);
  }

  /// Point-to-plane steps that draw the first points of the surface, turned, to a target.
  ///
  /// @param index  of the target.
  /// @param gate   how far a point may be from it, metres.
  Eigen::Isometry3f settle(const CellIndex& index, const std::vector<SurfacePoint>& target, std::size_t most,
                           float gate, Eigen::Isometry3f T) const {
    const std::size_t count = std::min(most, surface_.size());
    for (int i = 0; i < kRefinements && !control_.interrupted(); ++i) {
      Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
      Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
      for (std::size_t k = 0; k < count; ++k) {
        const SurfacePoint moved{T * surface_[k].position, T.linear() * surface_[k].normal};
        const int found = index.nearest(moved, gate);
        if (found < 0) continue;
        const SurfacePoint& near = target[found];
        Eigen::Matrix<double, 6, 1> row;
        row.head<3>() = ((moved.position - middle_) / radius()).cross(near.normal).cast<double>();
        row.tail<3>() = near.normal.cast<double>();
        A += row * row.transpose();
        b += row * static_cast<double>(near.normal.dot(near.position - moved.position));
      }
      // Damped: turns about an axis of revolution are free.
      A.diagonal().array() += 1e-4 * A.trace() / 6;
      const Eigen::Matrix<float, 6, 1> step = A.ldlt().solve(b).cast<float>();
      if (!step.allFinite()) break;
      T = Eigen::Translation3f(step.tail<3>()) * turn_about(middle_, rotation_by(step.head<3>() / radius())) * T;
    }
    return T;
  }

  /// The turns with the symmetric ones drawn to where they fit best: a small socket or key leaves a whole range of
  /// angles on the surface, to within the tolerance, and what was found lies anywhere in it.
  std::vector<RatedTurn> polished(std::vector<RatedTurn> turns) const {
    for (std::size_t i = 1; i < turns.size() && turns[i].share >= kSameShare && !control_.interrupted(); ++i) {
      Eigen::Isometry3f T = turns[i].T;
      for (int round = 0; round < 2; ++round) T = settle(finely_by_place_, dense_, kPolishPoints, on_surface_, T);
      if (share(T, kJudgedPoints) >= kSameShare) turns[i].T = T;
    }
    return turns;
  }

  void add(const Eigen::Isometry3f& T, std::vector<RatedTurn>& found) const {
    const bool known = std::any_of(found.begin(), found.end(), [&](const RatedTurn& other) {
      return same_turn(other.T, T, radius(), same_pose());
    });
    if (known || share(T, kGlancedPoints) < kSimilarShare) return;
    const double judged = share(T, kJudgedPoints);
    if (judged >= kSimilarShare) found.push_back({T, judged});
  }

  /// Leaves out turns on the flank of a better one: halfway to it the part fits no worse.
  std::vector<RatedTurn> peaks(const std::vector<RatedTurn>& turns) const {
    std::vector<RatedTurn> kept;
    for (const RatedTurn& turn : turns) {
      const bool on_flank = std::any_of(kept.begin(), kept.end(), [&](const RatedTurn& better) {
        return same_turn(better.T, turn.T, radius(), kFlank * radius()) && !control_.interrupted() &&
               share(halfway(better.T, turn.T, middle_), kJudgedPoints) >= turn.share - kDip;
      });
      if (!on_flank) kept.push_back(turn);
    }
    return kept;
  }

  /// Adds the products of turns: teeth that stand closer than the coarse search's step.
  void complete(std::vector<RatedTurn>& found) const {
    for (std::size_t i = 1; i < found.size(); ++i) {
      for (std::size_t j = 1; j <= i; ++j) {
        if (found.size() >= kMostSimilar || control_.interrupted()) return;
        add(found[i].T * found[j].T, found);
      }
    }
  }

  const std::vector<SurfacePoint>& dense_;
  const std::vector<SurfacePoint>& surface_;
  const RunControl& control_;
  float diameter_, on_surface_;
  std::vector<SurfacePoint> sparse_;  ///< evenly spread all the same
  CellIndex sparsely_by_place_, by_place_, finely_by_place_;
  Eigen::Vector3f middle_;
};

}  // namespace

SelfSimilarity find_self_similarity(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface,
                                    double diameter, const RunControl& control) {
  const TurnSearch search(dense, surface, diameter, control);
  const std::vector<RatedTurn> turns = search.find();
  SelfSimilarity result;
  Symmetry& symmetry = result.symmetry;
  for (std::size_t i = 1; i < turns.size() && turns[i].share >= kSameShare && !symmetry.has_axis; ++i) {
    if (!search.revolves_about_axis_of(turns[i].T)) continue;
    const auto [direction, point] = axis_of(turns[i].T, search.middle());
    symmetry.has_axis = true;
    symmetry.axis_direction = direction.cast<double>();
    symmetry.axis_point = point.cast<double>();
  }
  const auto same = [&](const Eigen::Isometry3f& a, const Eigen::Isometry3f& b) {
    return symmetry.has_axis ? same_axis(a, b, symmetry, search.radius(), search.same_pose())
                             : same_turn(a, b, search.radius(), search.same_pose());
  };
  // Best first: all that is symmetry comes before what is only similar.
  for (std::size_t i = 1; i < turns.size(); ++i) {
    const Eigen::Isometry3f& T = turns[i].T;
    const bool symmetric = turns[i].share >= kSameShare;
    const bool known = std::any_of(symmetry.discrete.begin(), symmetry.discrete.end(), [&](const Pose& S) {
      return same(S.cast<float>(), T) ||
             std::any_of(result.similar.begin(), result.similar.end(),
                         [&](const Pose& other) { return same(other.cast<float>() * S.cast<float>(), T); });
    });
    if (!known) (symmetric ? symmetry.discrete : result.similar).push_back(T.cast<double>());
  }
  return result;
}

std::vector<SurfacePoint> telling_points(const std::vector<SurfacePoint>& dense, const std::vector<Pose>& similar,
                                         double diameter, const RunControl& control) {
  CellIndex index(dense, static_cast<float>(kOnSurface * diameter));
  index.insert_all(control);
  std::vector<SurfacePoint> telling;
  for (const SurfacePoint& point : dense) {
    if (control.interrupted()) break;
    const bool moves_off = std::any_of(similar.begin(), similar.end(), [&](const Pose& pose) {
      const Eigen::Isometry3f T = pose.cast<float>();
      return !index.near({T * point.position, T.linear() * point.normal}, static_cast<float>(kOnSurface * diameter));
    });
    if (moves_off) telling.push_back(point);
  }
  return telling;
}

}  // namespace binpose

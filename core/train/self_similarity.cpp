#include "core/train/self_similarity.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/geometry/cell_index.h"
#include "core/geometry/pose.h"
#include "core/geometry/view_sphere.h"
#include "core/train/sample_surface.h"

namespace binpose {
namespace {

// Lengths as shares of the diameter.
constexpr double kReach = 0.1;  // of the coarse search
constexpr double kFirstGate = 0.7 * kReach;
constexpr double kSecondGate = kFirstGate / 2;
constexpr double kGridCell = 0.025;
constexpr double kOnSurface = 0.014;  // a point this near to the surface is on it
constexpr double kSamePose = 0.06;    // turns that move no corner of the box farther apart are one

constexpr int kDirections = 400;  // 10 degrees apart
constexpr int kTurns = 36;
constexpr int kCoarsePoints = 80;
constexpr double kCoarseShare = 0.6;
constexpr std::size_t kMostRefined = 300;
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

/// How near the surface is, by cell: 1 on it, falling to 0 at a reach.
class Nearness {
 public:
  Nearness(const std::vector<SurfacePoint>& surface, float diameter)
      : cell_(static_cast<float>(kGridCell) * diameter), reach_(static_cast<float>(kReach) * diameter) {
    Eigen::Array3f low = Eigen::Array3f::Constant(INFINITY), high = Eigen::Array3f::Constant(-INFINITY);
    for (const SurfacePoint& point : surface) {
      low = low.min(point.position.array());
      high = high.max(point.position.array());
    }
    low_ = low - reach_;
    size_ = ((high - low + 2 * reach_) / cell_).cast<int>() + 1;
    near_.assign(static_cast<std::size_t>(size_.prod()), 0);
    for (const SurfacePoint& point : surface) stamp(point.position);
  }

  float at(const Eigen::Vector3f& p) const {
    const Eigen::Array3i c = ((p.array() - low_) / cell_).floor().cast<int>();
    return (c >= 0).all() && (c < size_).all() ? near_[index(c)] : 0;
  }

 private:
  std::size_t index(const Eigen::Array3i& c) const {
    return (static_cast<std::size_t>(c[2]) * size_[1] + c[1]) * size_[0] + c[0];
  }
  void stamp(const Eigen::Vector3f& p) {
    const Eigen::Array3i first = ((p.array() - reach_ - low_) / cell_).cast<int>().max(0);
    const Eigen::Array3i last = ((p.array() + reach_ - low_) / cell_).cast<int>().min(size_ - 1);
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) {
          const Eigen::Array3i c(x, y, z);
          const Eigen::Vector3f middle = low_ + (c.cast<float>() + 0.5F) * cell_;
          float& near = near_[index(c)];
          near = std::max(near, 1 - (middle - p).squaredNorm() / (reach_ * reach_));
        }
      }
    }
  }

  float cell_, reach_;
  Eigen::Array3f low_;
  Eigen::Array3i size_;
  std::vector<float> near_;
};

struct RatedTurn {
  Eigen::Isometry3f T;
  double share;
};

Eigen::Matrix3f turn_towards(const Eigen::Vector3f& direction) {
  return Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), direction).toRotationMatrix();
}

bool same_turn(const Eigen::Isometry3f& a, const Eigen::Isometry3f& b, float radius, float most) {
  // The largest shift of a point at the radius is that of the rotation's angle.
  const float cosine = ((a.linear().transpose() * b.linear()).trace() - 1) / 2;
  return radius * std::sqrt(std::max(0.0F, 2 - 2 * cosine)) < most;
}

/// Turns about the middle by which the points come near the surface, best first, one of each kind.
std::vector<RatedTurn> coarse_turns(const Nearness& nearness, const std::vector<SurfacePoint>& surface,
                                    const Eigen::Vector3f& middle, float radius, const RunControl& control) {
  const std::size_t count = std::min<std::size_t>(kCoarsePoints, surface.size());
  std::vector<RatedTurn> turns;
  for (const Eigen::Vector3f& direction : view_directions(kDirections)) {
    if (control.interrupted()) return {};
    const Eigen::Matrix3f tilt = turn_towards(direction);
    for (int k = 0; k < kTurns; ++k) {
      const float angle = static_cast<float>(2 * std::numbers::pi * k / kTurns);
      const Eigen::Isometry3f T =
          turn_about(middle, tilt * Eigen::AngleAxisf(angle, Eigen::Vector3f::UnitZ()).toRotationMatrix());
      double sum = 0;
      for (std::size_t i = 0; i < count; ++i) sum += nearness.at(T * surface[i].position);
      if (sum >= kCoarseShare * static_cast<double>(count)) turns.push_back({T, sum / static_cast<double>(count)});
    }
  }
  std::stable_sort(turns.begin(), turns.end(),
                   [](const RatedTurn& a, const RatedTurn& b) { return a.share > b.share; });
  std::vector<RatedTurn> kept;
  for (const RatedTurn& turn : turns) {
    if (kept.size() >= kMostRefined || control.interrupted()) break;
    // 12 degrees: less than the grid's step would keep the flanks of each peak.
    const bool repeats = std::any_of(kept.begin(), kept.end(), [&](const RatedTurn& other) {
      return same_turn(other.T, turn.T, radius, 0.2F * radius);
    });
    if (!repeats) kept.push_back(turn);
  }
  return kept;
}

/// Share of the points that a turn leaves on the surface.
double share_on_surface(const CellIndex& index, const std::vector<SurfacePoint>& points, const Eigen::Isometry3f& T,
                        std::size_t most, float tolerance) {
  const std::size_t count = std::min(most, points.size());
  std::size_t on = 0;
  for (std::size_t i = 0; i < count; ++i) {
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
  TurnSearch(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface, double diameter)
      : dense_(dense),
        surface_(surface),
        diameter_(static_cast<float>(diameter)),
        on_surface_(static_cast<float>(kOnSurface) * diameter_),
        sparse_(surface.begin(), surface.begin() + std::min<std::ptrdiff_t>(kCoarseTargets, std::ssize(surface))),
        sparsely_by_place_(sparse_, first_gate()),
        by_place_(surface, second_gate()),
        finely_by_place_(dense, on_surface_) {
    sparsely_by_place_.insert_all();
    by_place_.insert_all();
    finely_by_place_.insert_all();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const SurfacePoint& point : dense) sum += point.position.cast<double>();
    middle_ = (sum / static_cast<double>(dense.size())).cast<float>();
  }

  /// All turns that leave most of the surface on itself, the identity first, then best first.
  std::vector<RatedTurn> find(const RunControl& control) const {
    std::vector<RatedTurn> found = {{Eigen::Isometry3f::Identity(), 1}};
    const Nearness nearness(surface_, diameter_);
    std::vector<Eigen::Isometry3f> settled;
    for (const RatedTurn& coarse : coarse_turns(nearness, surface_, middle_, radius(), control)) {
      if (control.interrupted()) break;
      const Eigen::Isometry3f near_by = settle(sparsely_by_place_, sparse_, kRefinePoints, first_gate(), coarse.T);
      const bool repeats = std::any_of(settled.begin(), settled.end(), [&](const Eigen::Isometry3f& other) {
        return same_turn(other, near_by, radius(), same_pose() / 3);
      });
      if (repeats) continue;
      settled.push_back(near_by);
      add(settle(by_place_, surface_, kRefinePoints, second_gate(), near_by), found);
    }
    complete(found, control);
    std::stable_sort(found.begin() + 1, found.end(),
                     [](const RatedTurn& a, const RatedTurn& b) { return a.share > b.share; });
    return polished(peaks(found, control), control);
  }

  /// Whether the part is one of revolution about the axis of a turn.
  bool revolves_about_axis_of(const Eigen::Isometry3f& T, const RunControl& control) const {
    const auto [direction, point] = axis_of(T, middle_);
    for (int i = 1; i <= kAxisProbes; ++i) {
      const float angle = static_cast<float>(2 * std::numbers::pi * std::fmod(0.6180339887 * i, 1.0));
      const Eigen::Isometry3f turn = turn_about(point, Eigen::AngleAxisf(angle, direction).toRotationMatrix());
      if (control.interrupted() || share(turn, kJudgedPoints) < kSameShare) return false;
    }
    return true;
  }

  float radius() const { return diameter_ / 2; }
  float same_pose() const { return static_cast<float>(kSamePose) * diameter_; }
  const Eigen::Vector3f& middle() const { return middle_; }

 private:
  float first_gate() const { return static_cast<float>(kFirstGate) * diameter_; }
  float second_gate() const { return static_cast<float>(kSecondGate) * diameter_; }

  double share(const Eigen::Isometry3f& T, std::size_t most) const {
    return share_on_surface(finely_by_place_, surface_, T, most, on_surface_);
  }

  /// Point-to-plane steps that draw the first points of the surface, turned, to a target.
  ///
  /// @param index  of the target.
  /// @param gate   how far a point may be from it, metres.
  Eigen::Isometry3f settle(const CellIndex& index, const std::vector<SurfacePoint>& target, std::size_t most,
                           float gate, Eigen::Isometry3f T) const {
    const std::size_t count = std::min(most, surface_.size());
    for (int i = 0; i < kRefinements; ++i) {
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
  std::vector<RatedTurn> polished(std::vector<RatedTurn> turns, const RunControl& control) const {
    for (std::size_t i = 1; i < turns.size() && turns[i].share >= kSameShare && !control.interrupted(); ++i) {
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
  std::vector<RatedTurn> peaks(const std::vector<RatedTurn>& turns, const RunControl& control) const {
    std::vector<RatedTurn> kept;
    for (const RatedTurn& turn : turns) {
      const bool on_flank = std::any_of(kept.begin(), kept.end(), [&](const RatedTurn& better) {
        return same_turn(better.T, turn.T, radius(), kFlank * radius()) && !control.interrupted() &&
               share(halfway(better.T, turn.T, middle_), kJudgedPoints) >= turn.share - kDip;
      });
      if (!on_flank) kept.push_back(turn);
    }
    return kept;
  }

  /// Adds the products of turns: teeth that stand closer than the coarse search's step.
  void complete(std::vector<RatedTurn>& found, const RunControl& control) const {
    for (std::size_t i = 1; i < found.size(); ++i) {
      for (std::size_t j = 1; j <= i; ++j) {
        if (found.size() >= kMostSimilar || control.interrupted()) return;
        add(found[i].T * found[j].T, found);
      }
    }
  }

  const std::vector<SurfacePoint>& dense_;
  const std::vector<SurfacePoint>& surface_;
  float diameter_, on_surface_;
  std::vector<SurfacePoint> sparse_;  ///< evenly spread all the same
  CellIndex sparsely_by_place_, by_place_, finely_by_place_;
  Eigen::Vector3f middle_;
};

}  // namespace

SelfSimilarity find_self_similarity(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface,
                                    double diameter, const RunControl& control) {
  const TurnSearch search(dense, surface, diameter);
  const std::vector<RatedTurn> turns = search.find(control);
  SelfSimilarity result;
  Symmetry& symmetry = result.symmetry;
  for (std::size_t i = 1; i < turns.size() && turns[i].share >= kSameShare && !symmetry.has_axis; ++i) {
    if (!search.revolves_about_axis_of(turns[i].T, control)) continue;
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
  index.insert_all();
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

#include "core/train/turn_search.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "core/geometry/pose.h"

namespace binpose {
namespace {

// Lengths as shares of the diameter.
constexpr double kFirstGate = 0.7 * kCoarseReach;
constexpr double kSecondGate = kFirstGate / 2;
constexpr double kSameTurn = 0.06;  // that no corner of the box moves by

constexpr int kRefinements = 4;  // at each gate
constexpr std::size_t kRefinePoints = 150;
constexpr std::size_t kCoarseTargets = 1500;
constexpr std::size_t kPolishPoints = 1000;
constexpr std::size_t kGlancedPoints = 400;  // a first judgement
constexpr float kFlank = 0.45F;  // radians, about 26 degrees, within which a turn may lie on another's flank
constexpr double kDip = 0.002;   // of the share, between two peaks

/// Half of the way from one turn to another.
Eigen::Isometry3f halfway(const Eigen::Isometry3f& a, const Eigen::Isometry3f& b, const Eigen::Vector3f& middle) {
  Eigen::Isometry3f T = Eigen::Isometry3f::Identity();
  T.linear() = Eigen::Quaternionf(a.linear()).slerp(0.5F, Eigen::Quaternionf(b.linear())).toRotationMatrix();
  T.translation() = (a * middle + b * middle) / 2 - T.linear() * middle;
  return T;
}

}  // namespace

TurnSearch::TurnSearch(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface,
                       double diameter, const RunControl& control)
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

std::vector<RatedTurn> TurnSearch::find() const {
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

float TurnSearch::same_pose() const { return static_cast<float>(kSameTurn) * diameter_; }

float TurnSearch::first_gate() const { return static_cast<float>(kFirstGate) * diameter_; }

float TurnSearch::second_gate() const { return static_cast<float>(kSecondGate) * diameter_; }

double TurnSearch::share(const Eigen::Isometry3f& T, std::size_t most) const {
  const std::size_t count = std::min(most, surface_.size());
  std::size_t on = 0;
  for (std::size_t i = 0; i < count && !control_.interrupted_at(i); ++i) {
    on += finely_by_place_.near({T * surface_[i].position, T.linear() * surface_[i].normal}, on_surface_);
  }
  return static_cast<double>(on) / static_cast<double>(count);
}

Eigen::Isometry3f TurnSearch::settle(const CellIndex& index, const std::vector<SurfacePoint>& target, std::size_t most,
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

std::vector<RatedTurn> TurnSearch::polished(std::vector<RatedTurn> turns) const {
  for (std::size_t i = 1; i < turns.size() && turns[i].share >= kSameShare && !control_.interrupted(); ++i) {
    Eigen::Isometry3f T = turns[i].T;
    for (int round = 0; round < 2; ++round) T = settle(finely_by_place_, dense_, kPolishPoints, on_surface_, T);
    if (share(T, kJudgedPoints) >= kSameShare) turns[i].T = T;
  }
  return turns;
}

void TurnSearch::add(const Eigen::Isometry3f& T, std::vector<RatedTurn>& found) const {
  const bool known = std::any_of(found.begin(), found.end(),
                                 [&](const RatedTurn& other) { return same_turn(other.T, T, radius(), same_pose()); });
  if (known || share(T, kGlancedPoints) < kSimilarShare) return;
  const double judged = share(T, kJudgedPoints);
  if (judged >= kSimilarShare) found.push_back({T, judged});
}

std::vector<RatedTurn> TurnSearch::peaks(const std::vector<RatedTurn>& turns) const {
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

void TurnSearch::complete(std::vector<RatedTurn>& found) const {
  for (std::size_t i = 1; i < found.size(); ++i) {
    for (std::size_t j = 1; j <= i; ++j) {
      if (found.size() >= kMostSimilar || control_.interrupted()) return;
      add(found[i].T * found[j].T, found);
    }
  }
}

}  // namespace binpose

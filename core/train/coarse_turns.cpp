#include "core/train/coarse_turns.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/geometry/pose.h"
#include "core/geometry/view_sphere.h"

namespace binpose {
namespace {

constexpr double kGridCell = 0.025;  // of the diameter
constexpr int kDirections = 400;     // 10 degrees apart
constexpr int kTurns = 36;
constexpr int kCoarsePoints = 80;
constexpr double kCoarseShare = 0.6;
constexpr std::size_t kMostRefined = 300;

/// How near the surface is, by cell: 1 on it, falling to 0 at a reach.
class Nearness {
 public:
  /// Stamped in part when `control` interrupts.
  Nearness(const std::vector<SurfacePoint>& surface, float diameter, const RunControl& control)
      : cell_(static_cast<float>(kGridCell) * diameter), reach_(static_cast<float>(kCoarseReach) * diameter) {
    Eigen::Array3f low = Eigen::Array3f::Constant(INFINITY), high = Eigen::Array3f::Constant(-INFINITY);
    for (const SurfacePoint& point : surface) {
      low = low.min(point.position.array());
      high = high.max(point.position.array());
    }
    low_ = low - reach_;
    size_ = ((high - low + 2 * reach_) / cell_).cast<int>() + 1;
    near_.assign(static_cast<std::size_t>(size_.prod()), 0);
    for (std::size_t i = 0; i < surface.size() && !control.interrupted_at(i); ++i) stamp(surface[i].position);
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

}  // namespace

bool same_turn(const Eigen::Isometry3f& a, const Eigen::Isometry3f& b, float radius, float most) {
  // The largest shift of a point at the radius is that of the rotation's angle.
  const float cosine = ((a.linear().transpose() * b.linear()).trace() - 1) / 2;
  return radius * std::sqrt(std::max(0.0F, 2 - 2 * cosine)) < most;
}

std::vector<RatedTurn> coarse_turns(const std::vector<SurfacePoint>& surface, const Eigen::Vector3f& middle,
                                    float diameter, const RunControl& control) {
  const Nearness nearness(surface, diameter, control);
  const float radius = diameter / 2;
  const std::size_t count = std::min<std::size_t>(kCoarsePoints, surface.size());
  std::vector<RatedTurn> turns;
  for (const Eigen::Vector3f& direction : view_directions(kDirections)) {
    if (control.interrupted()) return {};
    const Eigen::Matrix3f tilt = turn_of_z_to<float>(direction.normalized()).toRotationMatrix();
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

}  // namespace binpose

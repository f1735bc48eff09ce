#include "core/train/self_similarity.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "core/geometry/cell_index.h"
#include "core/geometry/pose.h"
#include "core/train/turn_search.h"

namespace binpose {
namespace {

constexpr int kAxisProbes = 16;
/// What a part of revolution may have besides, as a share of the surface, that turns about its axis take off it: less
/// than teeth, which hold a turn fast.
constexpr double kMarks = 0.1;
constexpr int kTurnsAboutAxis = 32;  // so many that a pose is one with its neighbours

struct Axis {
  Eigen::Vector3f direction, point;

  Eigen::Isometry3f turn(double angle) const {
    return turn_about(point, Eigen::AngleAxisf(static_cast<float>(angle), direction).toRotationMatrix());
  }
};

/// Whether two turns lay an axis on the same line, the same way round.
bool same_axis(const Eigen::Isometry3f& a, const Eigen::Isometry3f& b, const Symmetry& symmetry, float radius,
               float most) {
  const Eigen::Vector3f direction = symmetry.axis_direction.cast<float>(), point = symmetry.axis_point.cast<float>();
  return radius * (a.linear() * direction - b.linear() * direction).norm() < most &&
         (a * point - b * point).norm() < most;
}

/// The axis of a turn; its point is the one nearest to the middle.
Axis axis_of(const Eigen::Isometry3f& T, const Eigen::Vector3f& middle) {
  const Eigen::AngleAxisf turn(T.linear());
  const Eigen::Vector3f shift = T * middle - middle;
  const Eigen::Vector3f across = shift - turn.axis() * turn.axis().dot(shift);
  const float half = turn.angle() / 2;
  return {turn.axis(), middle + across / 2 + turn.axis().cross(across) / (2 * std::tan(half))};
}

/// Whether any turn about an axis leaves so much of the surface on itself.
bool revolves(const TurnSearch& search, const Axis& axis, double least_share, const RunControl& control) {
  for (int i = 1; i <= kAxisProbes; ++i) {
    const double angle = 2 * std::numbers::pi * std::fmod(0.6180339887 * i, 1.0);
    if (control.interrupted() || search.share(axis.turn(angle)) < least_share) return false;
  }
  return true;
}

/// The axis of the first turn about whose axis the part revolves, at least so much of it.
std::optional<Axis> find_axis(const TurnSearch& search, std::span<const RatedTurn> turns, double least_share,
                              const RunControl& control) {
  for (const RatedTurn& turn : turns) {
    if (turn.share < least_share) break;  // best first
    const Axis axis = axis_of(turn.T, search.middle());
    if (revolves(search, axis, std::max(least_share, turn.share - kMarks), control)) return axis;
  }
  return std::nullopt;
}

/// Whether a turn shows what one of those found does.
bool is_known(const TurnSearch& search, const SelfSimilarity& found, const Eigen::Isometry3f& T) {
  const Symmetry& symmetry = found.symmetry;
  const auto same = [&](const Eigen::Isometry3f& other) {
    return symmetry.has_axis ? same_axis(other, T, symmetry, search.radius(), search.same_pose())
                             : same_turn(other, T, search.radius(), search.same_pose());
  };
  return std::any_of(symmetry.discrete.begin(), symmetry.discrete.end(), [&](const Pose& S) {
    return same(S.cast<float>()) || std::any_of(found.similar.begin(), found.similar.end(), [&](const Pose& like) {
             return same(like.cast<float>() * S.cast<float>());
           });
  });
}

/// Instead of a few turns about an axis, on which the part hardly depends, and of others: even steps about it, by
/// themselves and before each of the others.
void spread_about(const Axis& axis, const TurnSearch& search, SelfSimilarity& found) {
  std::vector<Pose> bases = {Pose::Identity()};
  bases.insert(bases.end(), found.similar.begin(), found.similar.end());
  found.similar.clear();
  for (const Pose& base : bases) {
    for (int i = 0; i < kTurnsAboutAxis && found.similar.size() < kMostSimilar; ++i) {
      const Eigen::Isometry3f T = base.cast<float>() * axis.turn(2 * std::numbers::pi * i / kTurnsAboutAxis);
      if (!is_known(search, found, T)) found.similar.push_back(T.cast<double>());
    }
  }
}

}  // namespace

SelfSimilarity find_self_similarity(const std::vector<SurfacePoint>& dense, const std::vector<SurfacePoint>& surface,
                                    double diameter, const RunControl& control) {
  const TurnSearch search(dense, surface, diameter, control);
  const std::vector<RatedTurn> found = search.find();
  const std::span<const RatedTurn> turns = std::span(found).subspan(1);  // without the identity
  SelfSimilarity result;
  Symmetry& symmetry = result.symmetry;
  if (const std::optional<Axis> axis = find_axis(search, turns, kSameShare, control)) {
    symmetry.has_axis = true;
    symmetry.axis_direction = axis->direction.cast<double>();
    symmetry.axis_point = axis->point.cast<double>();
  }
  // Best first: all that is symmetry comes before what is only similar.
  for (const RatedTurn& turn : turns) {
    if (is_known(search, result, turn.T)) continue;
    (turn.share >= kSameShare ? symmetry.discrete : result.similar).push_back(turn.T.cast<double>());
  }
  if (symmetry.has_axis) return result;
  const std::optional<Axis> axis = find_axis(search, turns, kSimilarShare, control);
  if (axis) spread_about(*axis, search, result);
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

#include "core/geometry/view_sphere.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace binpose {
namespace {

/// Any direction has a viewpoint within this distance, times the root of their number. (Were it not so for some, their
/// search would only be slower.)
constexpr float kReach = 3;

}  // namespace

std::vector<Eigen::Vector3f> view_directions(int count) {
  constexpr double kGoldenAngle = std::numbers::pi * (3.0 - 2.23606797749978969);
  std::vector<Eigen::Vector3f> directions(count);
  for (int k = 0; k < count; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / count;
    const double radius = std::sqrt(1.0 - z * z);
    directions[k] =
        Eigen::Vector3d(radius * std::cos(k * kGoldenAngle), radius * std::sin(k * kGoldenAngle), z).cast<float>();
  }
  return directions;
}

int nearest_view(std::span<const Eigen::Vector3f> viewpoints, const Eigen::Vector3f& direction) {
  const Eigen::Vector3f unit = direction.normalized();
  const auto nearest_in = [&](std::size_t first, std::size_t last) {
    std::size_t best = first;
    float best_dot = -INFINITY;
    for (std::size_t k = first; k < last; ++k) {
      const float dot = viewpoints[k].dot(unit);
      if (dot > best_dot) {
        best_dot = dot;
        best = k;
      }
    }
    return std::pair(static_cast<int>(best), best_dot);
  };
  // What lies outside of a band of z is farther away than the band is high.
  const float reach = kReach / std::sqrt(static_cast<float>(viewpoints.size()));
  const auto below = [](const Eigen::Vector3f& view, float z) { return view.z() > z; };
  const auto first = std::lower_bound(viewpoints.begin(), viewpoints.end(), unit.z() + reach, below);
  const auto last = std::lower_bound(first, viewpoints.end(), unit.z() - reach, below);
  const auto [best, dot] = nearest_in(first - viewpoints.begin(), last - viewpoints.begin());
  if (2 - 2 * dot < reach * reach) return best;
  return nearest_in(0, viewpoints.size()).first;
}

}  // namespace binpose

#include "core/geometry/view_sphere.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace binpose {

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
  int best = 0;
  float best_dot = -INFINITY;
  for (int k = 0; k < static_cast<int>(viewpoints.size()); ++k) {
    const float dot = viewpoints[k].dot(direction);
    if (dot > best_dot) {
      best_dot = dot;
      best = k;
    }
  }
  return best;
}

}  // namespace binpose

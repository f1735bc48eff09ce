#include "core/detect/background.h"

#include <cmath>

#include "core/detect/support_plane.h"

namespace binpose {
namespace {

/// Whether a part's surface can lie there: inside of the walls and the floor by more than `margin`. Open towards +z.
bool inside(const OrientedBox& bin, const Eigen::Vector3d& p_scene, double margin) {
  const Eigen::Vector3d p = bin.in_box(p_scene);
  const Eigen::Vector3d half = 0.5 * bin.size;
  return std::abs(p.x()) < half.x() - margin && std::abs(p.y()) < half.y() - margin && p.z() > margin - half.z();
}

bool is_outside(const SearchSpace& space, const Eigen::Vector3d& p_scene, double diameter, double margin) {
  if (!in_a_region(space, p_scene, diameter)) return true;
  const std::optional<Plane>& plane = space.support_plane;
  if (plane && plane->normal.dot(p_scene) <= plane->offset + margin) return true;
  return space.bin_interior && !inside(*space.bin_interior, p_scene, margin);
}

}  // namespace

void mark_outside(DepthMap& map, const SearchSpace& space, double diameter) {
  if (space.regions.empty() && !space.support_plane && !space.bin_interior) return;
  const double margin = plane_tolerance(map, static_cast<float>(diameter));
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    if (!map.measured(static_cast<int>(i))) continue;
    const Eigen::Vector3d p_scene = map.T_scene_view * map.pixels[i].position.cast<double>();
    if (is_outside(space, p_scene, diameter, margin)) map.background[i] = 1;
  }
}

}  // namespace binpose

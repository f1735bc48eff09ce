#include "tests/support/ray_cast.h"

#include <cmath>
#include <limits>

#include "tests/scenes/random.h"

namespace binpose::testing {
namespace {

/// Distance to a triangle [Moeller and Trumbore], or infinity.
double distance_to(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d ab = b - a, ac = c - a, p = direction.cross(ac);
  const double det = ab.dot(p);
  if (std::abs(det) < 1e-18) return kMiss;
  const Eigen::Vector3d s = origin - a;
  const double u = s.dot(p) / det;
  if (u < 0 || u > 1) return kMiss;
  const Eigen::Vector3d q = s.cross(ab);
  const double v = direction.dot(q) / det;
  if (v < 0 || u + v > 1) return kMiss;
  const double t = ac.dot(q) / det;
  return t > 1e-9 ? t : kMiss;
}

}  // namespace

std::optional<RayHit> cast_ray(std::span<const PlacedMesh> bodies, const Eigen::Vector3d& origin,
                               const Eigen::Vector3d& direction) {
  std::optional<RayHit> nearest;
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    const Mesh& mesh = bodies[body].mesh;
    const Pose& T_scene_mesh = bodies[body].T_scene_mesh;
    const Pose T_mesh_scene = T_scene_mesh.inverse();
    const Eigen::Vector3d o = T_mesh_scene * origin, d = T_mesh_scene.linear() * direction;
    for (const auto& t : mesh.triangles) {
      const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                            c = mesh.vertices[t[2]].cast<double>();
      const double distance = distance_to(a, b, c, o, d);
      if (std::isinf(distance) || (nearest && nearest->distance <= distance)) continue;
      nearest = RayHit{distance, static_cast<int>(body), T_scene_mesh.linear() * (b - a).cross(c - a).normalized()};
    }
  }
  return nearest;
}

PointCloud render(std::span<const PlacedMesh> bodies, const PinholeSensor& sensor) {
  PointCloud cloud;
  cloud.width = static_cast<std::uint32_t>(sensor.width);
  cloud.height = static_cast<std::uint32_t>(sensor.height);
  scenes::Random random(sensor.seed);
  for (int v = 0; v < sensor.height; ++v) {
    for (int u = 0; u < sensor.width; ++u) {
      const Eigen::Vector3d ray((u - 0.5 * (sensor.width - 1)) / sensor.focal,
                                (v - 0.5 * (sensor.height - 1)) / sensor.focal, 1);
      const std::optional<RayHit> hit = cast_ray(bodies, Eigen::Vector3d::Zero(), ray);
      double depth = std::numeric_limits<double>::quiet_NaN();
      if (hit) depth = hit->distance;
      if (sensor.floor_depth && !(depth < *sensor.floor_depth)) depth = *sensor.floor_depth;
      if (sensor.noise > 0) depth += sensor.noise * random.normal();
      cloud.points.emplace_back((depth * ray).cast<float>());
    }
  }
  return cloud;
}

}  // namespace binpose::testing

#include "tests/scenes/penetration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tests/scenes/ray_scene.h"

namespace binpose::scenes {
namespace {

constexpr double kSpacing = 0.001;  // metres

/// Corners, edges and faces of the mesh, no gap wider than the spacing.
std::vector<Eigen::Vector3d> surface_points(const Mesh& mesh) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>();
    const Eigen::Vector3d ab = mesh.vertices[triangle[1]].cast<double>() - a;
    const Eigen::Vector3d ac = mesh.vertices[triangle[2]].cast<double>() - a;
    const double longest = std::max({ab.norm(), ac.norm(), (ab - ac).norm()});
    const int n = std::max(1, static_cast<int>(std::ceil(longest / kSpacing)));
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) points.emplace_back(a + ab * i / n + ac * j / n);
    }
  }
  return points;
}

/// Way out of the solid from a point within: the shortest of many straight ones.
double depth_inside(const RayScene& solid, const Eigen::Vector3d& point) {
  double depth = std::numeric_limits<double>::infinity();
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  const auto try_way = [&](const Eigen::Vector3d& direction) {
    const std::optional<RayHit> hit = solid.cast(point, direction);
    if (hit && hit->distance < depth) depth = hit->distance, way = hit->normal;
  };
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x || y || z) try_way(Eigen::Vector3d(x, y, z).normalized());
      }
    }
  }
  try_way(way);  // straight at the nearest face
  return depth;
}

}  // namespace

double deepest_penetration(const Mesh& part, const std::vector<Pose>& T_bin_models) {
  RayScene solid;
  solid.add(part, Pose::Identity());
  solid.build();
  Eigen::AlignedBox3d box;
  for (const auto& vertex : part.vertices) box.extend(vertex.cast<double>());
  const std::vector<Eigen::Vector3d> points = surface_points(part);

  double deepest = 0;
  for (const Pose& a : T_bin_models) {
    for (const Pose& b : T_bin_models) {
      if (&a == &b || (a * box.center() - b * box.center()).norm() > box.diagonal().norm()) continue;
      const Pose T_b_a = b.inverse() * a;
      for (const Eigen::Vector3d& point : points) {
        const Eigen::Vector3d placed = T_b_a * point;
        if (box.contains(placed) && solid.inside(placed)) deepest = std::max(deepest, depth_inside(solid, placed));
      }
    }
  }
  return deepest;
}

double deepest_outside(const Mesh& part, const std::vector<Pose>& T_bin_models, const Bin& bin) {
  double deepest = 0;
  for (const Pose& T_bin_model : T_bin_models) {
    for (const auto& vertex : part.vertices) {
      const Eigen::Vector3d placed = T_bin_model * vertex.cast<double>();
      deepest = std::max(deepest, -placed.z());
      if (placed.z() > bin.height) continue;
      deepest = std::max({deepest, std::abs(placed.x()) - bin.length / 2, std::abs(placed.y()) - bin.width / 2});
    }
  }
  return deepest;
}

}  // namespace binpose::scenes

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/pose.h"

/// What a sensor would see, the slow way: every ray against every triangle.
namespace binpose::testing {

/// A mesh that stands in a scene.
struct PlacedMesh {
  Mesh mesh;
  Pose T_scene_mesh = Pose::Identity();
};

/// Where a ray first meets a surface.
struct RayHit {
  double distance;  ///< in lengths of the direction
  int body;         ///< index of the mesh
  Eigen::Vector3d normal;
};

/// First hit of the ray with the triangles of the meshes, from either side, at a distance above 1e-9.
std::optional<RayHit> cast_ray(std::span<const PlacedMesh> bodies, const Eigen::Vector3d& origin,
                               const Eigen::Vector3d& direction);

/// A pinhole sensor at the origin that looks along z.
struct PinholeSensor {
  int width = 240, height = 180;
  double focal = 400;                        ///< pixels
  std::optional<double> floor_depth = 0.50;  ///< of a plane across the view, metres
  double noise = 0;                          ///< standard deviation along the ray, metres
  std::uint64_t seed = 1;
};

/// The cloud of a scene: row by row, NaN where a ray meets nothing. Equal seeds give equal clouds.
PointCloud render(std::span<const PlacedMesh> bodies, const PinholeSensor& sensor);

}  // namespace binpose::testing

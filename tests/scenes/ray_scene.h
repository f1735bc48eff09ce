#pragma once

#include <embree3/rtcore.h>

#include <cstdint>
#include <optional>

#include "core/geometry/mesh.h"
#include "core/geometry/pose.h"

namespace binpose::scenes {

/// Where a ray meets a surface first.
struct RayHit {
  double distance = 0;                               ///< metres along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, as the triangle is wound, not towards the ray
  std::uint32_t object = 0;                          ///< as add() numbered them
};

/// Posed meshes that rays can be cast at. Add the meshes, build once, then ask.
class RayScene {
 public:
  RayScene();
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Returns the number of the object, counting from 0.
  std::uint32_t add(const Mesh& mesh, const Pose& T_scene_mesh);
  void build();

  /// The first surface along the ray, either side of it; `direction` of unit length.
  std::optional<RayHit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  /// Whether a surface lies between the two points.
  bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

  /// Whether the point lies within a closed mesh.
  bool inside(const Eigen::Vector3d& point) const;

 private:
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace binpose::scenes

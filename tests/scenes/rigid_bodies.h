#pragma once

#include <btBulletDynamicsCommon.h>

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/geometry/pose.h"
#include "tests/scenes/convex_pieces.h"

namespace binpose::scenes {

/// Equal parts falling onto fixed blocks: Bullet, in metres and seconds, tuned for parts of a few centimetres.
/// One thread, fixed order: the same calls give the same poses.
class RigidBodies {
 public:
  /// @param part    closed; gives the centre of mass and the inertia, all of one density.
  /// @param pieces  the part cut convex; these collide.
  RigidBodies(const Mesh& part, const std::vector<ConvexPiece>& pieces);
  RigidBodies(const RigidBodies&) = delete;
  RigidBodies& operator=(const RigidBodies&) = delete;

  btRigidBody* add_block(const Eigen::AlignedBox3d& box);
  btRigidBody* add_part(const Pose& T_world_model, const Eigen::Vector3d& spin);
  void remove(btRigidBody* body);

  /// Goes on by kTimeStep.
  void step();

  /// T_world_model of a part.
  Pose pose_of(const btRigidBody& part) const;

  static constexpr double kTimeStep = 0.002;  ///< seconds

 private:
  btRigidBody* add(btCollisionShape* shape, double mass, const btVector3& inertia, const btTransform& start);

  Pose body_frame_;  ///< T_model_body: centre of mass, principal axes
  btVector3 inertia_;
  std::vector<std::unique_ptr<btConvexHullShape>> pieces_;
  btCompoundShape part_shape_;
  std::vector<std::unique_ptr<btBoxShape>> blocks_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
};

}  // namespace binpose::scenes

#include "tests/scenes/rigid_bodies.h"

#include <LinearMath/btConvexHullComputer.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace binpose::scenes {
namespace {

// Bullet is at its best with bodies a few units across.
constexpr double kUnitsPerMetre = 50;
constexpr double kMargin = 0.0004 * kUnitsPerMetre;  // Bullet rounds each piece by this ...
constexpr double kShrink = 0.0003 * kUnitsPerMetre;  // ... so it is shrunk first; the rest is a skin to press in
constexpr double kTopSpeed = 0.6 * kUnitsPerMetre;   // less than the thinnest part per step
constexpr double kTopSpin = 15;                      // radians per second

btVector3 to_bullet(const Eigen::Vector3d& v) {
  return {v.x() * kUnitsPerMetre, v.y() * kUnitsPerMetre, v.z() * kUnitsPerMetre};
}

btTransform to_bullet(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return btTransform({q.x(), q.y(), q.z(), q.w()}, to_bullet(Eigen::Vector3d(pose.translation())));
}

Pose from_bullet(const btTransform& transform) {
  const btQuaternion q = transform.getRotation();
  const btVector3& t = transform.getOrigin();
  return Eigen::Translation3d(Eigen::Vector3d(t.x(), t.y(), t.z()) / kUnitsPerMetre) *
         Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).normalized();
}

btVector3 shortened(const btVector3& v, double longest) {
  const double length = v.length();
  return length > longest ? v * (longest / length) : v;
}

/// Centre and spread (covariance) of the solid that a closed mesh bounds.
struct Moments {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
};

Moments moments(const Mesh& mesh) {
  double volume = 0;
  Moments sum;
  for (const auto& triangle : mesh.triangles) {  // each spans a tetrahedron with the origin
    const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>();
    const Eigen::Vector3d b = mesh.vertices[triangle[1]].cast<double>();
    const Eigen::Vector3d c = mesh.vertices[triangle[2]].cast<double>();
    const Eigen::Vector3d abc = a + b + c;
    const double six_volumes = a.dot(b.cross(c));
    volume += six_volumes / 6;
    sum.centre += six_volumes / 24 * abc;
    sum.spread +=
        six_volumes / 120 * (abc * abc.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  const Eigen::Vector3d centre = sum.centre / volume;
  return {centre, sum.spread / volume - centre * centre.transpose()};
}

}  // namespace

RigidBodies::RigidBodies(const Mesh& part, const std::vector<ConvexPiece>& pieces)
    : dispatcher_(&configuration_), world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  const Moments solid = moments(part);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(solid.spread);
  Eigen::Matrix3d axes = principal.eigenvectors();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  body_frame_ = Eigen::Translation3d(solid.centre) * Eigen::Quaterniond(axes);
  const Eigen::Vector3d s = principal.eigenvalues() * kUnitsPerMetre * kUnitsPerMetre;
  inertia_ = btVector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());

  for (const ConvexPiece& piece : pieces) {
    std::vector<btVector3> corners;
    for (const auto& corner : piece) corners.push_back(to_bullet(body_frame_.inverse() * corner));
    btConvexHullComputer hull;
    hull.compute(corners.data()->m_floats, sizeof(btVector3), static_cast<int>(corners.size()), kShrink, 0.5);
    pieces_.push_back(std::make_unique<btConvexHullShape>(hull.vertices[0].m_floats, hull.vertices.size()));
    pieces_.back()->setMargin(kMargin);
    part_shape_.addChildShape(btTransform::getIdentity(), pieces_.back().get());
  }

  // Contacts last while closer than this, on small pieces as on large ones; else piles of small pieces creep.
  gContactBreakingThreshold = 0.0004 * kUnitsPerMetre;
  dispatcher_.setDispatcherFlags(dispatcher_.getDispatcherFlags() &
                                 ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
  world_.setGravity({0, 0, -9.81 * kUnitsPerMetre});
  btContactSolverInfo& solver = world_.getSolverInfo();
  solver.m_numIterations = 40;
  solver.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  solver.m_splitImpulsePenetrationThreshold = 0;  // bodies are pushed apart without gaining speed
  solver.m_erp2 = 0.4;
}

btRigidBody* RigidBodies::add_block(const Eigen::AlignedBox3d& box) {
  blocks_.push_back(std::make_unique<btBoxShape>(to_bullet(Eigen::Vector3d(box.sizes() / 2))));
  blocks_.back()->setMargin(kMargin);
  const btTransform place(btQuaternion::getIdentity(), to_bullet(Eigen::Vector3d(box.center())));
  return add(blocks_.back().get(), 0, {0, 0, 0}, place);
}

btRigidBody* RigidBodies::add_part(const Pose& T_world_model, const Eigen::Vector3d& spin) {
  btRigidBody* body = add(&part_shape_, 1, inertia_, to_bullet(T_world_model * body_frame_));
  body->setAngularVelocity({spin.x(), spin.y(), spin.z()});
  return body;
}

btRigidBody* RigidBodies::add(btCollisionShape* shape, double mass, const btVector3& inertia,
                              const btTransform& start) {
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  info.m_startWorldTransform = start;
  info.m_friction = 0.5;
  info.m_rollingFriction = 0.002;
  info.m_restitution = 0.05;
  info.m_linearDamping = 0.1;
  info.m_angularDamping = 0.3;
  bodies_.push_back(std::make_unique<btRigidBody>(info));
  btRigidBody* body = bodies_.back().get();
  body->setActivationState(DISABLE_DEACTIVATION);
  world_.addRigidBody(body);
  return body;
}

void RigidBodies::remove(btRigidBody* body) { world_.removeRigidBody(body); }

void RigidBodies::step() {
  for (const auto& body : bodies_) {
    if (body->isStaticObject()) continue;
    body->setLinearVelocity(shortened(body->getLinearVelocity(), kTopSpeed));
    body->setAngularVelocity(shortened(body->getAngularVelocity(), kTopSpin));
  }
  world_.stepSimulation(kTimeStep, 0);
}

Pose RigidBodies::pose_of(const btRigidBody& part) const {
  return from_bullet(part.getWorldTransform()) * body_frame_.inverse();
}

}  // namespace binpose::scenes

#pragma once

#include <Eigen/Geometry>
#include <type_traits>

namespace binpose {

/// Rigid transform; `T_outer_inner` maps inner to outer coordinates, so inner letters cancel in products.
using Pose = Eigen::Isometry3d;

/// A small motion of a pose: translation in metres, then a rotation vector in radians.
using Twist = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The same small motions told of another point of the moving body, `shift` away from the one that they are told of.
inline Matrix6d seen_from(const Eigen::Vector3d& shift) {
  Matrix6d m = Matrix6d::Identity();  // translation' = translation + rotation x shift
  m.topRightCorner<3, 3>() << 0, shift.z(), -shift.y(), -shift.z(), 0, shift.x(), shift.y(), -shift.x(), 0;
  return m;
}

/// The turn by R about a point that stays where it is.
template <typename Scalar>
Eigen::Transform<Scalar, 3, Eigen::Isometry> turn_about(const Eigen::Vector<Scalar, 3>& point,
                                                        const std::type_identity_t<Eigen::Matrix<Scalar, 3, 3>>& R) {
  auto turn = Eigen::Transform<Scalar, 3, Eigen::Isometry>::Identity();
  turn.linear() = R;
  turn.translation() = point - R * point;
  return turn;
}

/// The rotation about the direction of a vector by its length, radians.
inline Eigen::Matrix3f rotation_by(const Eigen::Vector3f& rotation_vector) {
  const float angle = rotation_vector.norm();
  if (!(angle > 1e-9F)) return Eigen::Matrix3f::Identity();
  return Eigen::AngleAxisf(angle, rotation_vector / angle).toRotationMatrix();
}

/// Rotation angle between two orientations, radians in [0, pi].
inline double rotation_distance(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

}  // namespace binpose

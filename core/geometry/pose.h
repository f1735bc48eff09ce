#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <type_traits>

namespace binpose {

/// Rigid transform; `T_outer_inner` maps inner to outer coordinates, so inner letters cancel in products.
using Pose = Eigen::Isometry3d;

/// A small motion of a pose: translation in metres, then a rotation vector in radians.
using Twist = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The same small motions told of another point of the moving body, `shift` away from the one that they are told of.
Matrix6d seen_from(const Eigen::Vector3d& shift);

/// The turn by R about a point that stays where it is.
template <typename Scalar>
Eigen::Transform<Scalar, 3, Eigen::Isometry> turn_about(const Eigen::Vector<Scalar, 3>& point,
                                                        const std::type_identity_t<Eigen::Matrix<Scalar, 3, 3>>& R) {
  auto turn = Eigen::Transform<Scalar, 3, Eigen::Isometry>::Identity();
  turn.linear() = R;
  turn.translation() = point - R * point;
  return turn;
}

/// The least turn that leads the z axis to a direction, unit; the half turn about x if that is -z. (As Eigen's
/// FromTwoVectors, which has every file that calls it compile a singular value decomposition.)
template <typename Scalar>
Eigen::Quaternion<Scalar> turn_of_z_to(const Eigen::Vector<Scalar, 3>& direction) {
  const Scalar cosine = direction.z();
  if (!(cosine > Eigen::NumTraits<Scalar>::dummy_precision() - 1)) return {0, 1, 0, 0};
  const Scalar twice_w = std::sqrt((1 + cosine) * 2), inverse = 1 / twice_w;
  return {twice_w / 2, -direction.y() * inverse, direction.x() * inverse, 0};
}

/// The rotation about the direction of a vector by its length, radians.
Eigen::Matrix3f rotation_by(const Eigen::Vector3f& rotation_vector);

/// Rotation angle between two orientations, radians in [0, pi].
double rotation_distance(const Pose& a, const Pose& b);

}  // namespace binpose

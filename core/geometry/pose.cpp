#include "core/geometry/pose.h"

namespace binpose {

Matrix6d seen_from(const Eigen::Vector3d& shift) {
  Matrix6d m = Matrix6d::Identity();  // translation' = translation + rotation x shift
  m.topRightCorner<3, 3>() << 0, shift.z(), -shift.y(), -shift.z(), 0, shift.x(), shift.y(), -shift.x(), 0;
  return m;
}

Eigen::Matrix3f rotation_by(const Eigen::Vector3f& rotation_vector) {
  const float angle = rotation_vector.norm();
  if (!(angle > 1e-9F)) return Eigen::Matrix3f::Identity();
  return Eigen::AngleAxisf(angle, rotation_vector / angle).toRotationMatrix();
}

double rotation_distance(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

}  // namespace binpose

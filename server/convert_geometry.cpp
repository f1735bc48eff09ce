#include "server/convert_geometry.h"

#include "absl/strings/str_format.h"

namespace binpose::server {

absl::StatusOr<double> metres_per_unit(std::string_view field, v1::LengthUnit unit) {
  switch (unit) {
    case v1::LENGTH_UNIT_METRE:
      return 1.0;
    case v1::LENGTH_UNIT_MILLIMETRE:
      return 0.001;
    case v1::LENGTH_UNIT_UNSPECIFIED:
      return absl::InvalidArgumentError(absl::StrFormat(
          "%s is not set; it must be LENGTH_UNIT_METRE or LENGTH_UNIT_MILLIMETRE, there is no default.", field));
    default:
      return absl::InvalidArgumentError(
          absl::StrFormat("%s is %d; it must be LENGTH_UNIT_METRE (1) or LENGTH_UNIT_MILLIMETRE (2).", field, unit));
  }
}

Eigen::Vector3d to_vector(const v1::Vector3& message) { return {message.x(), message.y(), message.z()}; }

absl::StatusOr<Eigen::Quaterniond> to_rotation(std::string_view field, const v1::Quaternion& message) {
  const Eigen::Quaterniond rotation(message.w(), message.x(), message.y(), message.z());
  const double length = rotation.norm();
  if (length > 1e-6 && length < 1e6) return rotation.normalized();
  return absl::InvalidArgumentError(
      absl::StrFormat("%s is (x %g, y %g, z %g, w %g); it must be a rotation, a quaternion of length 1.", field,
                      message.x(), message.y(), message.z(), message.w()));
}

absl::StatusOr<Pose> to_pose(std::string_view field, const v1::Pose& message, double metres_per_unit) {
  Pose pose = Pose::Identity();
  if (message.has_orientation()) {
    const auto rotation = to_rotation(absl::StrFormat("%s.orientation", field), message.orientation());
    if (!rotation.ok()) return rotation.status();
    pose.linear() = rotation->toRotationMatrix();
  }
  pose.translation() = metres_per_unit * to_vector(message.position());
  return pose;
}

v1::Vector3 to_proto(const Eigen::Vector3d& vector) {
  v1::Vector3 message;
  message.set_x(vector.x());
  message.set_y(vector.y());
  message.set_z(vector.z());
  return message;
}

v1::Pose to_proto(const Pose& pose, double metres_per_unit) {
  v1::Pose message;
  *message.mutable_position() = to_proto(Eigen::Vector3d(pose.translation() / metres_per_unit));
  Eigen::Quaterniond orientation = Eigen::Quaterniond(pose.linear()).normalized();
  if (orientation.w() < 0) orientation.coeffs() *= -1;
  message.mutable_orientation()->set_x(orientation.x());
  message.mutable_orientation()->set_y(orientation.y());
  message.mutable_orientation()->set_z(orientation.z());
  message.mutable_orientation()->set_w(orientation.w());
  return message;
}

}  // namespace binpose::server

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <climits>
#include <cstdint>
#include <string_view>

#include "absl/status/statusor.h"
#include "binpose/v1/types.pb.h"
#include "core/geometry/pose.h"

namespace binpose::server {

/// The wire's unsigned count as core's int; what does not fit becomes the largest, which every range refuses.
inline int saturate(std::uint32_t count) { return static_cast<int>(std::min<std::uint32_t>(count, INT_MAX)); }

/// 1 or 0.001. Errors: INVALID_ARGUMENT (not said, or unknown), naming `field`.
absl::StatusOr<double> metres_per_unit(std::string_view field, v1::LengthUnit unit);

Eigen::Vector3d to_vector(const v1::Vector3& message);

/// Rotations of any length above 0 are taken. Errors: INVALID_ARGUMENT (zero or not finite), naming `field`.
absl::StatusOr<Eigen::Quaterniond> to_rotation(std::string_view field, const v1::Quaternion& message);

/// Positions become metres; an absent orientation is none. Errors: INVALID_ARGUMENT, naming `field`.
absl::StatusOr<Pose> to_pose(std::string_view field, const v1::Pose& message, double metres_per_unit);

v1::Vector3 to_proto(const Eigen::Vector3d& vector);

/// A pose whose position is in the unit given; the quaternion has unit length and w >= 0.
v1::Pose to_proto(const Pose& pose, double metres_per_unit);

}  // namespace binpose::server

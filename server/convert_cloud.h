#pragma once

#include <cstddef>

#include "absl/status/statusor.h"
#include "binpose/v1/types.pb.h"
#include "core/geometry/point_cloud.h"
#include "core/run_control.h"

namespace binpose::server {

inline constexpr std::size_t kMaxCloudPoints = 4'000'000;
/// No sensor sees farther, so what lies beyond is a fault of unit or encoding.
inline constexpr double kMaxCoordinateMetres = 1000;

/// A cloud as core wants it: metres, what is not finite as NaN, normals of unit length.
///
/// @param message  hostile; the fields are called "cloud..." in errors.
/// Errors, each naming field, value and limit: INVALID_ARGUMENT (unit missing, no encoding, no points, bytes that do
/// not fit width x height, intrinsics or scale out of range, a coordinate beyond kMaxCoordinateMetres, a normal that
/// has not unit length), RESOURCE_EXHAUSTED (more than kMaxCloudPoints, or more than kMaxDecodeTime); or what `control`
/// says.
absl::StatusOr<PointCloud> to_cloud(const v1::PointCloud& message, const RunControl& control = {});

}  // namespace binpose::server

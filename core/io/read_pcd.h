#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"
#include "core/run_control.h"

namespace binpose {

/// Reads the bytes of a PCD file (0.6 and 0.7; ascii, binary, binary_compressed) with float fields x y z and, if there,
/// normal_x normal_y normal_z; other fields are skipped. VIEWPOINT's translation becomes the sensor position.
///
/// Own code, because pcl_io would make the server's installation four times as large.
///
/// @param bytes            the file; hostile. NaN in x, y or z: no measurement.
/// @param metres_per_unit  1 or 0.001.
/// Errors, each naming the value and the limit: INVALID_ARGUMENT (truncated, self-contradicting, fields missing),
/// RESOURCE_EXHAUSTED (more than `max_points`, or more than 256 MiB when decompressed); or what `control` says.
absl::StatusOr<PointCloud> read_pcd(std::string_view bytes, double metres_per_unit, std::size_t max_points,
                                    const RunControl& control = {});

}  // namespace binpose

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/run_control.h"

namespace binpose {

/// The box of x/z and y/z that points fall into.
struct TangentBox {
  float low_x = INFINITY, high_x = -INFINITY, low_y = INFINITY, high_y = -INFINITY;

  /// z must be > 0.
  void extend(const Eigen::Vector3f& p) {
    const float x = p.x() / p.z(), y = p.y() / p.z();
    low_x = std::min(low_x, x);
    high_x = std::max(high_x, x);
    low_y = std::min(low_y, y);
    high_y = std::max(high_y, y);
  }
  void extend(const TangentBox& box) {
    low_x = std::min(low_x, box.low_x);
    high_x = std::max(high_x, box.high_x);
    low_y = std::min(low_y, box.low_y);
    high_y = std::max(high_y, box.high_y);
  }
};

/// The measured points of a cloud, seen from its sensor.
struct SensorView {
  Pose T_scene_view = Pose::Identity();
  std::vector<Eigen::Vector3f> points;   ///< in front of the sensor, view frame
  std::vector<Eigen::Vector3f> normals;  ///< of the points, or empty
  TangentBox window;                     ///< of the points
  float median_depth = 0;                ///< metres
  float spacing = 0;                     ///< typical distance of neighbouring points across the view, metres
  bool is_grid = false;                  ///< an image's points, row by row; else scattered
  double share_behind = 0;               ///< of the measured points: left out, as they lie beside or behind the sensor
};

/// Errors: INVALID_ARGUMENT when width x height does not fit the points, when no point is finite, or when none lies in
/// front of the sensor; CANCELLED.
absl::StatusOr<SensorView> sensor_view(const PointCloud& cloud, const RunControl& control = {});

}  // namespace binpose

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "core/geometry/pose.h"
#include "core/geometry/sensor_view.h"
#include "core/geometry/surface_point.h"
#include "core/run_control.h"

namespace binpose {

/// A point where a surface ends in front of something deeper: an outline, the rim of a hole, the edge of a step.
struct ContourPoint {
  Eigen::Vector3f position;
  Eigen::Vector3f normal;   ///< of the surface that ends
  Eigen::Vector3f outward;  ///< unit, across the view, away from the surface
};

/// A cloud as the sensor saw it: the nearest point of each cell of a pinhole image. The structure that normals,
/// verification, refinement and suppression all read.
///
/// View frame: origin at the sensor, z from the sensor to the middle of the cloud.
struct DepthMap {
  Pose T_scene_view = Pose::Identity();
  int width = 0, height = 0;
  float focal = 1;       ///< pixels, both axes
  float cx = 0, cy = 0;  ///< principal point, pixels; (0, 0) = centre of the first pixel
  float pixel_size = 0;  ///< metres that a pixel spans across the view at the median depth
  float noise = 0;       ///< standard deviation of the measurement along the surface normal, metres; 0: not known
  /// Row by row, view frame. position.z = 0: nothing measured; normals are unit, towards the sensor, or zero: none.
  std::vector<SurfacePoint> pixels;
  std::vector<std::uint8_t> background;  ///< 1: belongs to the support plane

  bool hides_points = false;  ///< the cloud holds many points behind the map's: see hidden_surfaces.h

  std::vector<ContourPoint> contours;  ///< see contours.h
  std::vector<int> contour_at;         ///< per pixel: index into `contours`, or -1

  bool measured(int i) const { return pixels[i].position.z() > 0; }
  bool has_normal(int i) const { return pixels[i].normal.z() != 0; }
  /// Index of the pixel that a point of the view frame falls into, or -1 outside of the image. z must be > 0.
  int pixel_of(const Eigen::Vector3f& p) const {
    const float u = focal * p.x() / p.z() + cx + 0.5F, v = focal * p.y() / p.z() + cy + 0.5F;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(width) && v < static_cast<float>(height))) return -1;
    return static_cast<int>(v) * width + static_cast<int>(u);
  }
};

/// Projects the points to pixels of `pixel_size` metres at the median depth (or larger ones, so that the image has at
/// most 4 million). Normals that came with the cloud are kept, otherwise none are set. A stop leaves pixels unmeasured.
DepthMap depth_map(const SensorView& view, double pixel_size, const RunControl& control = {});

}  // namespace binpose

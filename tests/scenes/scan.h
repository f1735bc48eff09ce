#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/pose.h"
#include "tests/scenes/bin.h"
#include "tests/scenes/random.h"

namespace binpose::scenes {

/// A structured-light scanner: a camera at the origin looking along +z, and a projector beside it. Metres.
struct Scanner {
  double point_spacing = 0.0008;  ///< between neighbouring points on the floor of the bin
  double distance = 0.8;          ///< of the floor of the bin
  double noise = 0.00012;         ///< standard deviation along the ray
  Eigen::Vector3d projector{0.11, -0.16, 0};
  double grazing_from = 70;    ///< degrees of incidence, of camera or projector, from which points drop out
  double grazing_to = 84;      ///< degrees of incidence at which none is left
  double flying_share = 0.15;  ///< of the pixels that straddle a depth edge, how many land in mid-air
};

/// A posed instance and how much of it the scanner saw.
struct Instance {
  Pose T_scene_model;
  int visible_points = 0;
  int alone_points = 0;  ///< that would be seen if nothing else lay in the bin
};

struct Scan {
  PointCloud cloud;  ///< organised, NaN = no measurement
  Pose T_scene_bin;
  std::vector<Instance> instances;
};

/// Scans a bin and what lies in it, from a little to the side, as `random` has it.
Scan scan_bin(const Mesh& part, const std::vector<Pose>& T_bin_models, const Bin& bin, const Scanner& scanner,
              Random random);

}  // namespace binpose::scenes

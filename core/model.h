#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "core/params.h"

namespace binpose {

/// A surface point of the model with its outward normal; model frame, metres.
struct SurfacePoint {
  Eigen::Vector3f position;
  Eigen::Vector3f normal;
};

/// Rigid motions that leave the surface where it was, within a tolerance; model frame.
struct Symmetry {
  std::vector<Pose> discrete = {Pose::Identity()};  ///< T_model_model, identity first
  bool has_axis = false;                            ///< any turn about the axis as well
  Eigen::Vector3d axis_point = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_direction = Eigen::Vector3d::UnitZ();
};

/// All that training produced; immutable once built and shared between threads. Saved and loaded by io/model_file.h,
/// which writes the "stored" members and rebuilds the "derived" ones.
struct Model {
  // Stored.
  TrainParams params;
  double diameter = 0;  ///< largest distance between two vertices, metres
  Eigen::Vector3d box_min = Eigen::Vector3d::Zero();
  Eigen::Vector3d box_max = Eigen::Vector3d::Zero();
  Symmetry symmetry;
  std::vector<std::string> warnings;  ///< what is odd about the mesh, one sentence each
};

}  // namespace binpose

#pragma once

#include <Eigen/Core>

namespace binpose {

/// A surface point with its outward normal; metres. Aligned so that one load takes all of it (see point_block.h).
struct alignas(32) SurfacePoint {
  Eigen::Vector3f position;
  Eigen::Vector3f normal;
};

}  // namespace binpose

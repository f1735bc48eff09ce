#pragma once

#include <Eigen/Core>
#include <vector>

#include "tests/bench/paper/oriented_cloud.h"

namespace binpose::paper {

/// Points and what describes the surface around them, row by row.
struct LocalFeatures {
  Cloud::Ptr points{new Cloud};
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> descriptors;
};

/// SHOT, 352 numbers of unit length, or FPFH, 33 numbers, of the surface within `radius` of each keypoint. Keypoints
/// without a descriptor (too few neighbours) are left out.
LocalFeatures shot_features(const Cloud::Ptr& surface, const Cloud::Ptr& keypoints, double radius);
LocalFeatures fpfh_features(const Cloud::Ptr& surface, const Cloud::Ptr& keypoints, double radius);

/// `more` behind `features`.
void append(LocalFeatures& features, const LocalFeatures& more);

/// The nearest descriptor of `among` for each of `of`, exactly.
struct Nearest {
  int index = -1;
  float squared_distance = 0;
};
std::vector<Nearest> nearest_features(const LocalFeatures& of, const LocalFeatures& among);

}  // namespace binpose::paper

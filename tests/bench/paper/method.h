#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/geometry/point_cloud.h"
#include "core/hypothesis.h"
#include "tests/support/bin_scene.h"

namespace binpose::paper {

/// Poses of one part in a cloud, best first; one thread.
using Finder = std::function<std::vector<PoseHypothesis>(const PointCloud&)>;

/// A row of the paper's Table I.
struct Method {
  std::string name;
  std::function<Finder(const testing::ScenePart&)> train;
};

/// SHOT descriptors [paper, 6] and PCL's grouping of geometrically consistent correspondences [paper, 11].
Finder train_shot_grouping(const testing::ScenePart& part);

/// FPFH descriptors [paper, 5] and PCL's RANSAC with early rejection of poor samples [paper, 12].
Finder train_fpfh_ransac(const testing::ScenePart& part);

/// The rows of Table I in its order, and binpose's default as the last.
std::vector<Method> all_methods();

}  // namespace binpose::paper

#pragma once

#include <span>
#include <vector>

#include "core/geometry/depth_map.h"
#include "core/model.h"
#include "tests/support/ray_cast.h"

namespace binpose::testing {

/// A model trained from few viewpoints, as tests have little time; the mesh must be a good one.
Model quick_model(const Mesh& mesh);

/// A scan as detection sees it when it looks for a part of the given diameter: pixels, normals, contours.
DepthMap scan_map(const PointCloud& cloud, double diameter);
DepthMap scan_map(std::span<const PlacedMesh> bodies, const PinholeSensor& sensor, double diameter);

/// Points in no order.
PointCloud scattered(std::vector<Eigen::Vector3f> points);

/// Points all over a part's surface, `spacing` metres apart: what no single sensor sees.
PointCloud all_sides(const Mesh& mesh, const Pose& T_scene_model, double spacing);

/// A sensor with the noise of a good scanner, for scenes of several parts.
PinholeSensor bin_sensor();

/// A part scanned at a pose, perhaps with something in front of it.
struct PartScan {
  Model model;
  Pose T_scene_model;
  std::vector<PlacedMesh> bodies;
  DepthMap map;

  PartScan(const Mesh& mesh, const Pose& pose, std::vector<PlacedMesh> others = {});
};

/// A pose of the scene frame in the map's view frame.
Eigen::Isometry3f in_view(const DepthMap& map, const Pose& T_scene_model);

/// A turn by degrees about an axis, then a shift.
Pose pose(double degrees, const Eigen::Vector3d& axis, const Eigen::Vector3d& translation);

}  // namespace binpose::testing

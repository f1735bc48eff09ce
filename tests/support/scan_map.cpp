#include "tests/support/scan_map.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/geometry/contours.h"
#include "core/geometry/normals.h"
#include "core/train/sample_surface.h"
#include "core/train/train.h"

namespace binpose::testing {

Model quick_model(const Mesh& mesh) {
  TrainParams params;
  params.viewpoint_count = 200;
  return train(mesh, params, {}).value();
}

DepthMap scan_map(const PointCloud& cloud, double diameter) {
  const SensorView view = sensor_view(cloud).value();
  DepthMap map = depth_map(view, std::max(0.014 * diameter, 1.2 * view.spacing));
  estimate_normals(map, 1);
  find_contours(map, static_cast<float>(0.03 * diameter), Unmeasured::kUnknown);
  return map;
}

DepthMap scan_map(std::span<const PlacedMesh> bodies, const PinholeSensor& sensor, double diameter) {
  return scan_map(render(bodies, sensor), diameter);
}

PointCloud scattered(std::vector<Eigen::Vector3f> points) {
  PointCloud cloud;
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.height = 1;
  cloud.points = std::move(points);
  return cloud;
}

PointCloud all_sides(const Mesh& mesh, const Pose& T_scene_model, double spacing) {
  std::vector<Eigen::Vector3f> points;
  for (const SurfacePoint& point : thin_evenly(scatter(mesh, spacing / 4), spacing)) {
    points.emplace_back((T_scene_model * point.position.cast<double>()).cast<float>());
  }
  return scattered(std::move(points));
}

PinholeSensor bin_sensor() {
  PinholeSensor sensor;
  sensor.width = 320;
  sensor.height = 240;
  sensor.focal = 450;
  sensor.noise = 1e-4;
  return sensor;
}

PartScan::PartScan(const Mesh& mesh, const Pose& pose, std::vector<PlacedMesh> others)
    : model(quick_model(mesh)), T_scene_model(pose), bodies(std::move(others)) {
  bodies.push_back({mesh, pose});
  map = scan_map(bodies, {}, model.diameter);
}

Eigen::Isometry3f in_view(const DepthMap& map, const Pose& T_scene_model) {
  return Eigen::Isometry3f((map.T_scene_view.inverse() * T_scene_model).matrix().cast<float>());
}

Pose pose(double degrees, const Eigen::Vector3d& axis, const Eigen::Vector3d& translation) {
  Pose T(Eigen::AngleAxisd(degrees * kDegree, axis.normalized()));
  T.pretranslate(translation);
  return T;
}

}  // namespace binpose::testing

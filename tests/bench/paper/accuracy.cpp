#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/train/sample_surface.h"
#include "tests/bench/paper/over_scenes.h"
#include "tests/bench/paper/runs.h"
#include "tests/bench/paper/scan_alone.h"
#include "tests/bench/paper/vector_pairs.h"
#include "tests/scenes/random.h"

namespace binpose::paper {
namespace {

/// How a moved part becomes a cloud.
struct SceneKind {
  bool whole_surface;  ///< the paper's: the model's own surface moved, all sides at once; else what a sensor sees
  int density_mm;      ///< between points

  double spacing() const { return 0.001 * density_mm; }  // metres
  std::string name() const {
    return (whole_surface ? "whole surface, " : "one side, ") + std::to_string(density_mm) + " mm";
  }
};
constexpr SceneKind kSceneKinds[] = {{true, 3}, {false, 3}, {false, 1}};
constexpr double kMostTurn = 30;    // degrees, about each axis
constexpr double kMostShift = 0.3;  // metres, along each axis
constexpr double kDistance = 0.8;   // metres, from the sensor to the middle of the places
constexpr double kDegrees = 180 / std::numbers::pi;

/// Turned about x, y and z, then shifted, at random.
Pose random_pose(scenes::Random random) {
  const auto angle = [&] { return random.uniform(-kMostTurn, kMostTurn) / kDegrees; };
  const auto shift = [&] { return random.uniform(-kMostShift, kMostShift); };
  const Eigen::AngleAxisd turn_x(angle(), Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd turn_y(angle(), Eigen::Vector3d::UnitY());
  const Eigen::AngleAxisd turn_z(angle(), Eigen::Vector3d::UnitZ());
  const double x = shift(), y = shift(), z = shift();
  return Eigen::Translation3d(x, y, kDistance + z) * Pose(turn_z * turn_y * turn_x);
}

/// Points all over the part's surface, with its normals.
PointCloud moved_surface(const Mesh& part, const Pose& T_scene_model, double spacing) {
  PointCloud cloud;
  for (const SurfacePoint& point : thin_evenly(scatter(part, spacing / 4), spacing)) {
    cloud.points.emplace_back((T_scene_model * point.position.cast<double>()).cast<float>());
    cloud.normals.emplace_back((T_scene_model.linear() * point.normal.cast<double>()).cast<float>());
  }
  cloud.width = static_cast<std::uint32_t>(cloud.points.size());
  cloud.height = 1;
  return cloud;
}

/// The largest of the three turns about x, y and z that lead from one rotation to the other, degrees.
double rotation_error(const Pose& estimate, const Pose& truth) {
  const Eigen::Matrix3d R = truth.linear().transpose() * estimate.linear();
  const Eigen::Vector3d angles(std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
                               std::atan2(R(1, 0), R(0, 0)));
  return angles.cwiseAbs().maxCoeff() * kDegrees;
}

Json errors(const Finder& find, const PointCloud& cloud, const Pose& truth, const Eigen::Vector3d& centre) {
  const std::vector<PoseHypothesis> poses = find(cloud);
  if (poses.empty()) return nullptr;
  const Pose& found = poses.front().T_scene_model;
  const Eigen::Vector3d apart = found * centre - truth * centre;
  return {{"degrees", rotation_error(found, truth)}, {"mm", 1000 * apart.cwiseAbs().maxCoeff()}};
}

}  // namespace

void run_accuracy(const std::filesystem::path& parts, int count, const std::filesystem::path& output) {
  const testing::ScenePart part = testing::read_parts(parts).front();
  const Model paper = train_model(part, TrainParams::paper());
  DetectParams any_score;  // the best pose counts, however sure the method is
  any_score.min_score = any_score.presence_score = 0;
  const NamedFinders finders = {{"unrefined", finder(paper, paper_detection(false))},
                                {"integration", finder(paper, paper_detection(true))},
                                {"binpose", finder(train_model(part, {}), any_score)}};
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& vertex : part.mesh.vertices) box.extend(vertex.cast<double>());

  RunLog log(output);
  const scenes::Random random(5);
  for (const SceneKind& kind : kSceneKinds) {
    for (int i = 0; i < count; ++i) {
      const std::string key = kind.name() + ", scene " + std::to_string(i);
      if (log.has(key)) continue;
      const Pose T_scene_model = random_pose(random.fork(i));
      const PointCloud cloud = kind.whole_surface ? moved_surface(part.mesh, T_scene_model, kind.spacing())
                                                  : scan_alone(part.mesh, T_scene_model, kind.spacing());
      Json results;
      for (const auto& [name, find] : finders) results[name] = errors(find, cloud, T_scene_model, box.center());
      log.add(key, {{"scene", kind.name()}, {"density_mm", kind.density_mm}, {"results", results}});
      if ((i + 1) % 50 == 0) show_progress("accuracy", i + 1, count, kind.name());
    }
  }
}

}  // namespace binpose::paper

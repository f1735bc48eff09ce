#include <pcl/correspondence.h>
#include <pcl/recognition/cg/geometric_consistency.h>

#include <algorithm>
#include <memory>
#include <numeric>

#include "tests/bench/paper/local_features.h"
#include "tests/bench/paper/method.h"
#include "tests/bench/paper/pose_list.h"

namespace binpose::paper {
namespace {

// Lengths as shares of the diameter; tuned on scenes of other seeds than those that are reported, see PAPER.md.
constexpr double kSpacing = 0.02;
constexpr double kModelKeypoints = 0.04;
constexpr double kSceneKeypoints = 0.05;
constexpr double kRadius = 0.25;
constexpr double kConsistency = 0.04;
constexpr int kLeastGroup = 4;
constexpr std::size_t kMostGroups = 60;  // aligned and judged, largest first
constexpr int kViews = 42;
constexpr double kDistance = 0.8;  // metres, from the sensor

struct ShotModel {
  double diameter = 0;
  std::vector<ModelView> views;
  LocalFeatures features;  ///< of all views
};

pcl::CorrespondencesPtr correspondences(const LocalFeatures& model, const LocalFeatures& scene) {
  pcl::CorrespondencesPtr all(new pcl::Correspondences);
  const std::vector<Nearest> nearest = nearest_features(scene, model);
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    all->emplace_back(nearest[i].index, static_cast<int>(i), nearest[i].squared_distance);
  }
  return all;
}

/// Poses of groups of correspondences that keep their distances, largest group first.
std::vector<Pose> grouped(const LocalFeatures& model, const LocalFeatures& scene, double diameter) {
  pcl::GeometricConsistencyGrouping<pcl::PointNormal, pcl::PointNormal> grouping;
  grouping.setInputCloud(model.points);
  grouping.setSceneCloud(scene.points);
  grouping.setModelSceneCorrespondences(correspondences(model, scene));
  grouping.setGCSize(kConsistency * diameter);
  grouping.setGCThreshold(kLeastGroup);
  std::vector<Eigen::Matrix4f, Eigen::aligned_allocator<Eigen::Matrix4f>> transforms;
  std::vector<pcl::Correspondences> groups;
  grouping.recognize(transforms, groups);
  std::vector<std::size_t> order(groups.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return groups[a].size() > groups[b].size(); });
  order.resize(std::min(order.size(), kMostGroups));
  std::vector<Pose> poses;
  poses.reserve(order.size());
  for (const std::size_t i : order) poses.emplace_back(transforms[i].cast<double>());
  return poses;
}

}  // namespace

Finder train_shot_grouping(const testing::ScenePart& part) {
  auto model = std::make_shared<ShotModel>();
  model->diameter = part.diameter;
  model->views = model_views(part, kViews, kDistance, kSpacing * part.diameter);
  for (const ModelView& view : model->views) {
    const Cloud::Ptr points = keypoints(view.surface, kModelKeypoints * part.diameter);
    append(model->features, shot_features(view.surface, points, kRadius * part.diameter));
  }
  return [model = std::shared_ptr<const ShotModel>(model)](const PointCloud& scan) {
    const double diameter = model->diameter;
    const Cloud::Ptr scene = oriented_cloud(scan, kSpacing * diameter);
    remove_support_plane(*scene, kSpacing * diameter);
    const LocalFeatures features =
        shot_features(scene, keypoints(scene, kSceneKeypoints * diameter), kRadius * diameter);
    return pose_list(grouped(model->features, features, diameter), scene, model->views, diameter);
  };
}

}  // namespace binpose::paper

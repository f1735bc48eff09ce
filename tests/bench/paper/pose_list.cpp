#include "tests/bench/paper/pose_list.h"

#include <pcl/common/transforms.h>
#include <pcl/registration/icp.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <set>

namespace binpose::paper {
namespace {

constexpr double kGate = 0.05;       // of the diameter: what ICP pairs
constexpr double kTolerance = 0.02;  // of the diameter: what counts as explained
constexpr int kIterations = 15;
constexpr double kLeastShare = 0.5;  // explained, of a pose that is answered
constexpr double kMostTaken = 0.5;   // of what a pose explains, by better ones
constexpr float kNormalCosine = 0.8F;

using Tree = pcl::search::KdTree<pcl::PointNormal>;

struct Judged {
  PoseHypothesis hypothesis;
  std::set<int> explained;  ///< points of the scene
};

Pose align(const Pose& T_scene_model, const Cloud::Ptr& scene, const Tree::Ptr& tree, const ModelView& view,
           double diameter) {
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  icp.setInputSource(view.surface);
  icp.setInputTarget(scene);
  icp.setSearchMethodTarget(tree, true);
  icp.setMaxCorrespondenceDistance(kGate * diameter);
  icp.setMaximumIterations(kIterations);
  icp.setTransformationEpsilon(1e-8);
  Cloud aligned;
  icp.align(aligned, T_scene_model.matrix().cast<float>());
  Eigen::Isometry3f T(icp.getFinalTransformation());
  return icp.hasConverged() ? Pose(T.cast<double>()) : T_scene_model;
}

Judged judge(const Pose& T_scene_model, const Cloud& scene, const Tree& tree, const ModelView& view, double diameter) {
  Judged judged;
  judged.hypothesis.T_scene_model = T_scene_model;
  Cloud placed;
  const Eigen::Matrix4f T = T_scene_model.matrix().cast<float>();
  pcl::transformPointCloudWithNormals(*view.surface, placed, T);
  int explained = 0;
  pcl::Indices nearest(1);
  std::vector<float> squared(1);
  for (const pcl::PointNormal& point : placed) {
    tree.nearestKSearch(point, 1, nearest, squared);
    if (squared[0] > kTolerance * kTolerance * diameter * diameter) continue;
    if (point.getNormalVector3fMap().dot(scene[nearest[0]].getNormalVector3fMap()) < kNormalCosine) continue;
    ++explained;
    judged.explained.insert(nearest[0]);
  }
  judged.hypothesis.score =
      static_cast<double>(explained) / static_cast<double>(std::max<std::size_t>(1, placed.size()));
  return judged;
}

}  // namespace

std::vector<PoseHypothesis> pose_list(const std::vector<Pose>& T_scene_models, const Cloud::Ptr& scene,
                                      const std::vector<ModelView>& views, double diameter) {
  const Tree::Ptr tree(new Tree);
  tree->setInputCloud(scene);
  std::vector<Judged> all;
  for (const Pose& found : T_scene_models) {
    const ModelView& view = views[nearest_view(views, found)];
    all.push_back(judge(align(found, scene, tree, view, diameter), *scene, *tree, view, diameter));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Judged& a, const Judged& b) { return a.hypothesis.score > b.hypothesis.score; });
  std::vector<PoseHypothesis> kept;
  std::set<int> taken;
  for (const Judged& judged : all) {
    if (judged.hypothesis.score < kLeastShare) break;
    const auto doubles = std::count_if(judged.explained.begin(), judged.explained.end(),
                                       [&](int point) { return taken.contains(point); });
    if (static_cast<double>(doubles) > kMostTaken * static_cast<double>(judged.explained.size())) continue;
    taken.insert(judged.explained.begin(), judged.explained.end());
    kept.push_back(judged.hypothesis);
  }
  return kept;
}

}  // namespace binpose::paper

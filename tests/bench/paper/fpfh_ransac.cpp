#include <pcl/registration/sample_consensus_prerejective.h>

#include <cstdlib>
#include <memory>

#include "tests/bench/paper/local_features.h"
#include "tests/bench/paper/method.h"
#include "tests/bench/paper/pose_list.h"

namespace binpose::paper {
namespace {

// Lengths as shares of the diameter; tuned on scenes of other seeds than those that are reported, see PAPER.md.
constexpr double kSpacing = 0.02;
constexpr double kKeypoints = 0.05;
constexpr double kRadius = 0.2;
constexpr double kInlierDistance = 0.04;
constexpr float kLeastInliers = 0.3F;
constexpr float kSimilarity = 0.9F;
constexpr int kIterations = 30000;  // per view
constexpr int kNearest = 5;         // scene descriptors that a sample is drawn from
constexpr int kViews = 24;
constexpr double kDistance = 0.8;  // metres, from the sensor

using Descriptors = pcl::PointCloud<pcl::FPFHSignature33>;

struct FpfhModel {
  double diameter = 0;
  std::vector<ModelView> views;
  std::vector<LocalFeatures> features;  ///< of each view
};

Descriptors::Ptr to_pcl(const LocalFeatures& features) {
  Descriptors::Ptr descriptors(new Descriptors);
  for (const auto& row : features.descriptors.rowwise()) {
    pcl::FPFHSignature33 descriptor;
    std::copy(row.begin(), row.end(), descriptor.histogram);
    descriptors->push_back(descriptor);
  }
  return descriptors;
}

/// The best pose of each view of the model, where RANSAC finds one.
std::vector<Pose> sampled_poses(const FpfhModel& model, const LocalFeatures& scene) {
  std::srand(1);  // PCL draws from it
  pcl::SampleConsensusPrerejective<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> ransac;
  ransac.setInputTarget(scene.points);
  ransac.setTargetFeatures(to_pcl(scene));
  ransac.setMaximumIterations(kIterations);
  ransac.setNumberOfSamples(3);
  ransac.setCorrespondenceRandomness(kNearest);
  ransac.setSimilarityThreshold(kSimilarity);
  ransac.setMaxCorrespondenceDistance(kInlierDistance * model.diameter);
  ransac.setInlierFraction(kLeastInliers);
  std::vector<Pose> poses;
  for (const LocalFeatures& view : model.features) {
    ransac.setInputSource(view.points);
    ransac.setSourceFeatures(to_pcl(view));
    Cloud aligned;
    ransac.align(aligned);
    if (ransac.hasConverged()) poses.emplace_back(ransac.getFinalTransformation().cast<double>());
  }
  return poses;
}

}  // namespace

Finder train_fpfh_ransac(const testing::ScenePart& part) {
  auto model = std::make_shared<FpfhModel>();
  model->diameter = part.diameter;
  model->views = model_views(part, kViews, kDistance, kSpacing * part.diameter);
  for (const ModelView& view : model->views) {
    const Cloud::Ptr points = keypoints(view.surface, kKeypoints * part.diameter);
    model->features.push_back(fpfh_features(view.surface, points, kRadius * part.diameter));
  }
  return [model = std::shared_ptr<const FpfhModel>(model)](const PointCloud& scan) {
    const double diameter = model->diameter;
    const Cloud::Ptr scene = oriented_cloud(scan, kSpacing * diameter);
    remove_support_plane(*scene, kSpacing * diameter);
    const LocalFeatures features = fpfh_features(scene, keypoints(scene, kKeypoints * diameter), kRadius * diameter);
    return pose_list(sampled_poses(*model, features), scene, model->views, diameter);
  };
}

}  // namespace binpose::paper

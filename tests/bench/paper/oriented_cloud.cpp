#include "tests/bench/paper/oriented_cloud.h"

#include <pcl/common/io.h>
#include <pcl/features/normal_3d.h>
#include <pcl/filters/uniform_sampling.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <algorithm>
#include <cmath>

namespace binpose::paper {
namespace {

constexpr double kNormalRadius = 2.5;  // in spacings
constexpr double kShareBehind = 0.02;

}  // namespace

Cloud::Ptr oriented_cloud(const PointCloud& scan, double spacing) {
  const pcl::PointCloud<pcl::PointXYZ>::Ptr points(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3f& p : scan.points) {
    if (!std::isnan(p.z())) points->push_back({p.x(), p.y(), p.z()});
  }
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  const auto leaf = static_cast<float>(spacing);
  grid.setLeafSize(leaf, leaf, leaf);
  grid.setInputCloud(points);
  pcl::PointCloud<pcl::PointXYZ> thinned;
  grid.filter(thinned);

  Cloud::Ptr cloud(new Cloud);
  pcl::copyPointCloud(thinned, *cloud);
  pcl::NormalEstimation<pcl::PointNormal, pcl::PointNormal> normals;  // towards (0, 0, 0) unless told otherwise
  normals.setInputCloud(cloud);
  normals.setRadiusSearch(kNormalRadius * spacing);
  normals.compute(*cloud);
  std::erase_if(cloud->points, [](const pcl::PointNormal& p) { return !std::isfinite(p.normal_z); });
  cloud->resize(cloud->points.size());
  return cloud;
}

void remove_support_plane(Cloud& cloud, double tolerance) {
  pcl::SACSegmentation<pcl::PointNormal> segmentation;
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setDistanceThreshold(tolerance);
  segmentation.setMaxIterations(500);
  segmentation.setInputCloud(cloud.makeShared());
  pcl::PointIndices on_plane;
  pcl::ModelCoefficients coefficients;
  segmentation.segment(on_plane, coefficients);
  if (coefficients.values.size() != 4) return;
  Eigen::Vector4f plane(coefficients.values.data());
  if (plane[3] < 0) plane = -plane;  // the sensor on the positive side
  const auto height = [&](const pcl::PointNormal& p) { return plane.dot(p.getVector3fMap().homogeneous()); };
  const auto behind = std::count_if(cloud.begin(), cloud.end(), [&](const auto& p) { return height(p) < -tolerance; });
  if (static_cast<double>(behind) > kShareBehind * static_cast<double>(cloud.size())) return;
  std::erase_if(cloud.points, [&](const auto& p) { return height(p) < tolerance; });
  cloud.resize(cloud.points.size());
}

Cloud::Ptr keypoints(const Cloud::Ptr& cloud, double spacing) {
  pcl::UniformSampling<pcl::PointNormal> sampling;
  sampling.setRadiusSearch(spacing);
  sampling.setInputCloud(cloud);
  Cloud::Ptr kept(new Cloud);
  sampling.filter(*kept);
  return kept;
}

}  // namespace binpose::paper

#include "tests/bench/paper/model_views.h"

#include <pcl/common/transforms.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "core/geometry/view_sphere.h"
#include "tests/bench/paper/scan_alone.h"

namespace binpose::paper {
namespace {

constexpr int kRaysPerSpacing = 3;

}  // namespace

std::vector<ModelView> model_views(const testing::ScenePart& part, int count, double distance, double spacing) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : part.mesh.vertices) box.extend(vertex);
  const Eigen::Vector3d centre = box.center().cast<double>();
  std::vector<ModelView> views;
  for (const Eigen::Vector3f& direction : view_directions(count)) {
    const Eigen::Vector3d towards_viewer = direction.cast<double>();
    const Pose T_view_model = Eigen::Translation3d(0, 0, distance) *
                              Pose(Eigen::Quaterniond::FromTwoVectors(towards_viewer, -Eigen::Vector3d::UnitZ())) *
                              Eigen::Translation3d(-centre);
    const Cloud::Ptr seen = oriented_cloud(scan_alone(part.mesh, T_view_model, spacing / kRaysPerSpacing), spacing);
    const Cloud::Ptr surface(new Cloud);
    const Eigen::Matrix4f T_model_view = T_view_model.inverse().matrix().cast<float>();
    pcl::transformPointCloudWithNormals(*seen, *surface, T_model_view);
    views.push_back({towards_viewer, surface});
  }
  return views;
}

int nearest_view(const std::vector<ModelView>& views, const Pose& T_scene_model) {
  const Eigen::Vector3d towards_viewer = T_scene_model.linear().transpose() * -T_scene_model.translation();
  const auto nearest = std::max_element(views.begin(), views.end(), [&](const ModelView& a, const ModelView& b) {
    return a.towards_viewer.dot(towards_viewer) < b.towards_viewer.dot(towards_viewer);
  });
  return static_cast<int>(nearest - views.begin());
}

}  // namespace binpose::paper

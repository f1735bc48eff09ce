#include "tests/bench/paper/scan_alone.h"

#include <Eigen/Geometry>
#include <limits>

#include "tests/scenes/ray_scene.h"

namespace binpose::paper {

PointCloud scan_alone(const Mesh& part, const Pose& T_scene_model, double spacing) {
  scenes::RayScene scene;
  scene.add(part, T_scene_model);
  scene.build();
  Eigen::AlignedBox2d image;  // on the plane z = 1
  Eigen::AlignedBox3d body;
  for (const Eigen::Vector3f& vertex : part.vertices) {
    const Eigen::Vector3d p = T_scene_model * vertex.cast<double>();
    body.extend(p);
    image.extend(Eigen::Vector2d(p.head<2>() / p.z()));
  }
  const double focal = body.center().z() / spacing;
  PointCloud cloud;
  cloud.width = static_cast<std::uint32_t>(image.sizes().x() * focal) + 2;
  cloud.height = static_cast<std::uint32_t>(image.sizes().y() * focal) + 2;
  cloud.intrinsics = CameraIntrinsics{focal, focal, -focal * image.min().x(), -focal * image.min().y()};
  for (std::uint32_t v = 0; v < cloud.height; ++v) {
    for (std::uint32_t u = 0; u < cloud.width; ++u) {
      const Eigen::Vector3d ray =
          Eigen::Vector3d((u - cloud.intrinsics->cx) / focal, (v - cloud.intrinsics->cy) / focal, 1).normalized();
      const auto hit = scene.cast(Eigen::Vector3d::Zero(), ray);
      cloud.points.push_back(hit ? Eigen::Vector3f((hit->distance * ray).cast<float>())
                                 : Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    }
  }
  return cloud;
}

}  // namespace binpose::paper

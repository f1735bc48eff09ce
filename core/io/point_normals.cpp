#include "core/io/point_normals.h"

#include <cstddef>

namespace binpose {

void normalize_or_drop_normals(PointCloud& cloud) {
  for (std::size_t i = 0; i < cloud.normals.size(); ++i) {
    const Eigen::Vector3d normal = cloud.normals[i].cast<double>();
    const bool is_usable = normal.allFinite() && normal.squaredNorm() > 0;
    if (!is_usable && cloud.points[i].allFinite()) {
      cloud.normals.clear();
      return;
    }
    if (is_usable) cloud.normals[i] = normal.normalized().cast<float>();
  }
}

}  // namespace binpose

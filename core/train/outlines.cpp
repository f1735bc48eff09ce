#include "core/train/outlines.h"

#include <Eigen/Geometry>

#include "core/geometry/contours.h"
#include "core/geometry/hidden_surfaces.h"
#include "core/geometry/normals.h"
#include "core/parallel.h"

namespace binpose {
namespace {

constexpr float kViewerDistance = 20;  // diameters: rays are parallel to 1.5 degrees

/// View frame of a far viewer: z from the viewer to the part.
Eigen::Isometry3f view_frame(const Eigen::Vector3f& viewpoint, float distance, const Eigen::Vector3f& centre) {
  Eigen::Isometry3f T_view_model = Eigen::Isometry3f::Identity();
  const Eigen::Vector3f right = viewpoint.unitOrthogonal();
  T_view_model.linear().row(0) = right;
  T_view_model.linear().row(1) = right.cross(viewpoint);
  T_view_model.linear().row(2) = -viewpoint;
  T_view_model.translation() = Eigen::Vector3f(0, 0, distance) - T_view_model.linear() * centre;
  return T_view_model;
}

}  // namespace

std::vector<std::vector<ContourPoint>> outlines(std::span<const SurfacePoint> dense,
                                                std::span<const Eigen::Vector3f> viewpoints, double diameter,
                                                double pixel, double step, const RunControl& control) {
  std::vector<std::vector<ContourPoint>> views(viewpoints.size());
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  for (const SurfacePoint& point : dense) centre += point.position / static_cast<float>(dense.size());
  const float distance = kViewerDistance * static_cast<float>(diameter);
  parallel_for(static_cast<int>(viewpoints.size()), control.threads, [&](int k) {
    if (control.interrupted()) return;
    const Eigen::Isometry3f T_view_model = view_frame(viewpoints[k], distance, centre);
    SensorView view;
    view.median_depth = distance;
    view.points.reserve(dense.size());
    view.normals.reserve(dense.size());
    for (const SurfacePoint& point : dense) {
      const float cosine = point.normal.dot(viewpoints[k]);
      view.points.push_back(T_view_model * point.position);
      view.window.extend(view.points.back());
      // What a sensor sees too steeply hides what is behind it, but shows no contour.
      view.normals.push_back(cosine > kGrazingCosine ? Eigen::Vector3f(T_view_model.linear() * point.normal)
                                                     : Eigen::Vector3f::Zero());
    }
    DepthMap map = depth_map(view, pixel, control);
    hide_behind_gaps(map);  // between the points
    find_contours(map, static_cast<float>(step), Unmeasured::kFar);
    views[k] = std::move(map.contours);
    const Eigen::Isometry3f T_model_view = T_view_model.inverse();
    for (ContourPoint& contour : views[k]) {
      contour = {T_model_view * contour.position, T_model_view.linear() * contour.normal,
                 T_model_view.linear() * contour.outward};
    }
  });
  return views;
}

}  // namespace binpose

#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "core/geometry/point_cloud.h"

namespace binpose::paper {

/// Points with normals, metres: what the methods of PCL work on.
using Cloud = pcl::PointCloud<pcl::PointNormal>;

/// A scan thinned to one point per cube of `spacing`, with normals towards the sensor at the origin.
Cloud::Ptr oriented_cloud(const PointCloud& scan, double spacing);

/// Takes out the plane that the parts lie on: the largest one, if next to nothing is behind it.
void remove_support_plane(Cloud& cloud, double tolerance);

/// One point per cube of `spacing`, none moved.
Cloud::Ptr keypoints(const Cloud::Ptr& cloud, double spacing);

}  // namespace binpose::paper

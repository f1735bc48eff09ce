#pragma once

#include "core/geometry/point_cloud.h"

namespace binpose {

/// Makes the normals of a cloud from outside unit vectors; drops all of them when a measured point has none (zero or
/// not finite), so that they are estimated from the points as if none had been sent.
void normalize_or_drop_normals(PointCloud& cloud);

}  // namespace binpose

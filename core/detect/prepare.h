#pragma once

#include "core/geometry/depth_map.h"
#include "core/model.h"
#include "core/params.h"
#include "core/run_control.h"

namespace binpose {

/// The depth map that suits a model, with all that its search reads: normals, the background that the parameters speak
/// of, contours. Part of it when `control` interrupts.
DepthMap prepare(const SensorView& view, const Model& model, const DetectParams& params,
                 const RunControl& control = {});

}  // namespace binpose

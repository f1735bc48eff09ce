#pragma once

#include "core/geometry/depth_map.h"
#include "core/run_control.h"

namespace binpose {

/// Share of the points that lie clearly behind the map's point on their ray. One sensor sees next to none; a cloud
/// merged from several views, or taken from all sides of a part, holds many.
double hidden_share(const SensorView& view, const DepthMap& map);

/// Takes away what shows through gaps of a nearer surface: a pixel clearly behind the morphological closing (3 x 3) of
/// the map's nearness, which bridges gaps of less than three pixels and leaves planes as they are. Does nothing when
/// `control` interrupts.
void hide_behind_gaps(DepthMap& map, const RunControl& control = {});

/// The points as seen from as far behind their median depth as the sensor is before it: the farthest comes first.
/// Points that such a view does not have before it are left out; without any when `control` stops it.
SensorView from_behind(const SensorView& view, const RunControl& control = {});

}  // namespace binpose

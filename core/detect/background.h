#pragma once

#include "core/geometry/depth_map.h"
#include "core/search_space.h"

namespace binpose {

/// Marks as background what cannot be a part's: the support plane and what is under it, the bin's walls and floor and
/// what is outside of it, and what is too far from every region to belong to a part whose centre lies in one.
/// @param diameter  of the part, metres.
void mark_outside(DepthMap& map, const SearchSpace& space, double diameter);

}  // namespace binpose

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace binpose {

/// One bit per viewpoint.
using ViewMask = std::vector<std::uint64_t>;

/// `count` directions spread evenly over the sphere (a Fibonacci lattice), by falling z; unit vectors from the part to
/// the viewer.
std::vector<Eigen::Vector3f> view_directions(int count);

/// Index of the viewpoint nearest to `direction`, which need not have unit length.
/// @param viewpoints  as from view_directions(); at least 1.
int nearest_view(std::span<const Eigen::Vector3f> viewpoints, const Eigen::Vector3f& direction);

inline bool sees(const ViewMask& mask, int view) { return (mask[view / 64] >> (view % 64)) & 1; }

}  // namespace binpose

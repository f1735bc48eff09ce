#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/detect/rank.h"

/// Which pose explains which pixel.
namespace binpose {

inline constexpr int kNobody = -1;

/// Marks the pixels that a pose explains as those of `index`: around each visible model point those that measure the
/// same surface.
void own_pixels(const DepthMap& map, const Model& model, const Candidate& candidate, float tolerance, int index,
                std::vector<int>& owner);

/// The owners of what lies in front of a pose's surface, where they hide more than a trace of it, ascending.
std::vector<int> find_occluders(const DepthMap& map, const Model& model, const Candidate& candidate, int index,
                                const std::vector<int>& owner);

/// Holds every pixel (column, row) that points in a box of the model fall on under a pose, and those that own_pixels()
/// marks for them.
Eigen::AlignedBox2i image_box(const DepthMap& map, const Eigen::AlignedBox3f& box,
                              const Eigen::Isometry3f& T_view_model);

}  // namespace binpose

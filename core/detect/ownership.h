#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/detect/rank.h"

/// Which pose explains which pixel.
namespace binpose {

inline constexpr int kNobody = -1;

/// The pixels that a pose explains, some more than once: around each visible model point those that measure the same
/// surface.
std::vector<int> explained_pixels(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                                  float tolerance);

/// The owners of what lies in front of a pose's surface, where they hide more than a trace of it, ascending.
std::vector<int> find_occluders(const DepthMap& map, const Model& model, const Candidate& candidate, int index,
                                const std::vector<int>& owner);

/// Holds every pixel (column, row) that a pose's visible points fall on, and those that explained_pixels() gives.
Eigen::AlignedBox2i image_box(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model);

}  // namespace binpose

#pragma once

#include <algorithm>
#include <vector>

#include "core/detect/point_block.h"

namespace binpose {

/// Outline points under a pose, eight at a time.
struct OutlineBlock {
  LanePoints point, normal, outward;  ///< view frame; lanes without a point have z = -1

  /// Takes up to eight points of an outline from `first` on, `stride` apart.
  [[gnu::always_inline]] void load(const std::vector<ContourPoint>& outline, std::size_t first, int stride,
                                   const Eigen::Isometry3f& T_view_model) {
    const std::size_t left = (outline.size() - first + stride - 1) / stride;
    const int count = static_cast<int>(std::min<std::size_t>(kLanes, left));
    LaneBuffer positions, normals, outwards;
    for (int i = 0; i < kLanes; ++i) {
      const ContourPoint& contour = outline[first + (i < count ? i * stride : 0)];
      positions.set(i, contour.position);
      normals.set(i, contour.normal);
      outwards.set(i, contour.outward);
    }
    point = transform(T_view_model, positions.load());
    normal = rotate(T_view_model, normals.load());
    outward = rotate(T_view_model, outwards.load());
    for (int i = count; i < kLanes; ++i) point.z[i] = -1;
  }

  /// The points moved by so many metres outward.
  [[gnu::always_inline]] LanePoints moved(float distance) const {
    return {point.x + distance * outward.x, point.y + distance * outward.y, point.z + distance * outward.z};
  }
};

}  // namespace binpose

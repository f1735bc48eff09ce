#pragma once

#include <algorithm>
#include <cmath>

#include "core/detect/point_block.h"

/// How the points in which poses of a part differ are weighed.
namespace binpose {

/// Measured in front by less than this share of the diameter: not another part that hides the point, but this one, in
/// another pose.
inline constexpr float kOwnDepth = 0.08F;
/// Between the centres of poses that may be of one part, as a share of the diameter.
inline constexpr float kSamePlace = 0.6F;
/// Share of what a pose explains that another explains, too; with less they are two parts side by side.
inline constexpr float kSameSurface = 0.7F;
/// Poses less likely than this against the best are ruled out.
inline constexpr float kRuledOut = 0.05F;

/// What the scan says to each point of a block: how squarely the point is seen if it was measured there, the negative
/// of that if another surface was, 0 if it is hidden, not measured, or seen under less than the cosine `steepest`.
[[gnu::always_inline]] inline Lanes telling_weights(const PointBlock& block, float steepest, float tolerance,
                                                    float diameter) {
  const Lanes zero = {};
  const Lanes distance = dot(block.normal, block.scene_point - block.point);
  const LaneInts judged =
      (block.point.z > 0) & (block.scene_point.z > 0) & (block.scene_point.z >= block.point.z - kOwnDepth * diameter);
  const Lanes cosine = -dot(block.normal, block.point) / root(dot(block.point, block.point));
  const Lanes facing = (judged & (cosine > steepest)) ? cosine : zero;
  return magnitude(distance) <= tolerance ? facing : -facing;
}

/// How many times as likely a pose is as another whose points weigh less by `lead`.
///
/// @param spacing  of the points, pixels.
inline float likelihood_ratio(float lead, float spacing) {
  /// Log of the odds that one pixel adds; neighbouring pixels repeat each other.
  constexpr float kPixelWeight = 0.28F;
  return std::exp(kPixelWeight * std::min(1.0F, spacing * spacing) * lead);
}

}  // namespace binpose

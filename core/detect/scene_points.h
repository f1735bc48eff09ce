#pragma once

#include <vector>

#include "core/geometry/depth_map.h"
#include "core/vector_pair.h"

namespace binpose {

/// Evenly spaced oriented points of a scene [paper, section IV 1], found by image block.
struct ScenePoints {
  std::vector<SurfacePoint> points;  ///< view frame, by block, row by row
  int block_size = 1;                ///< pixels
  int columns = 0, rows = 0;         ///< blocks
  std::vector<int> first;            ///< per block, and after the last: its point, or else the next block's

  /// Index of a block's point, or -1.
  int at_block(int block) const { return first[block] < first[block + 1] ? first[block] : -1; }
};

/// Keeps per block of the image the pixel nearest its middle that has a normal and is no background.
ScenePoints down_sample(const DepthMap& map, int block_size);

/// Which points to start pairs from: `share` of them, spread evenly over the image; ascending indices.
std::vector<int> start_points(const ScenePoints& scene, double share);

}  // namespace binpose

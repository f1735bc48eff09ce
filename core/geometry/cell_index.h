#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/vector_pair.h"

namespace binpose {

/// Surface points found by place and side. Holds a reference to the points; only those inserted are found.
class CellIndex {
 public:
  /// @param cell_size  metres; the largest distance that can be asked for.
  CellIndex(const std::vector<SurfacePoint>& points, float cell_size) : points_(points), inverse_(1 / cell_size) {}

  void insert(std::uint32_t index) { cells_[key(cell(points_[index].position))].push_back(index); }
  void insert_all() {
    for (std::uint32_t i = 0; i < points_.size(); ++i) insert(i);
  }

  /// Index of the nearest point within `distance` <= the cell size whose normal is less than 60 degrees off, or -1.
  int nearest(const SurfacePoint& point, float distance) const {
    const Eigen::Array3i centre = cell(point.position);
    int best = -1;
    float least = distance * distance;
    for (int i = 0; i < 27; ++i) {
      const auto found = cells_.find(key(centre + Eigen::Array3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const std::uint32_t other : found->second) {
        const float sq_distance = (points_[other].position - point.position).squaredNorm();
        if (sq_distance < least && points_[other].normal.dot(point.normal) > kSameSideCosine) {
          best = static_cast<int>(other);
          least = sq_distance;
        }
      }
    }
    return best;
  }
  bool near(const SurfacePoint& point, float distance) const { return nearest(point, distance) >= 0; }

 private:
  static constexpr float kSameSideCosine = 0.5F;

  Eigen::Array3i cell(const Eigen::Vector3f& p) const { return (p.array() * inverse_).floor().cast<int>(); }
  static std::uint64_t key(const Eigen::Array3i& c) {
    constexpr std::uint64_t kMask = (1U << 21) - 1;
    return (c[0] & kMask) << 42 | (c[1] & kMask) << 21 | (c[2] & kMask);
  }

  const std::vector<SurfacePoint>& points_;
  float inverse_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace binpose

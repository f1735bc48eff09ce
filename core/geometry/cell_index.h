#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/run_control.h"
#include "core/vector_pair.h"

namespace binpose {

/// Surface points found by place and side. Holds a reference to the points; only those inserted are found.
class CellIndex {
 public:
  /// @param cell_size  metres; the largest distance that can be asked for.
  CellIndex(const std::vector<SurfacePoint>& points, float cell_size) : points_(points), inverse_(1 / cell_size) {}

  void insert(std::uint32_t index) { cells_[key(cell(points_[index].position))].push_back(index); }
  /// Part of them when `control` interrupts.
  void insert_all(const RunControl& control = {}) {
    for (std::uint32_t i = 0; i < points_.size() && !control.interrupted_at(i); ++i) insert(i);
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
        if (!matches(points_[other], point, least)) continue;
        best = static_cast<int>(other);
        least = (points_[other].position - point.position).squaredNorm();
      }
    }
    return best;
  }
  /// Whether nearest() finds one; many times as fast where it does.
  bool near(const SurfacePoint& point, float distance) const {
    const Eigen::Array3i centre = cell(point.position);
    for (int k = 0; k < 27; ++k) {
      const int i = (k + 13) % 27;  // the point's own cell first
      const auto found = cells_.find(key(centre + Eigen::Array3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const std::uint32_t other : found->second) {
        if (matches(points_[other], point, distance * distance)) return true;
      }
    }
    return false;
  }

 private:
  static constexpr float kSameSideCosine = 0.5F;

  static bool matches(const SurfacePoint& a, const SurfacePoint& b, float below_sq_distance) {
    return (a.position - b.position).squaredNorm() < below_sq_distance && a.normal.dot(b.normal) > kSameSideCosine;
  }
  Eigen::Array3i cell(const Eigen::Vector3f& p) const { return (p.array() * inverse_).floor().cast<int>(); }
  static std::uint64_t key(const Eigen::Array3i& c) {
    constexpr std::uint64_t kMask = (1U << 21) - 1;
    return (c[0] & kMask) << 42 | (c[1] & kMask) << 21 | (c[2] & kMask);
  }

  const std::vector<SurfacePoint>& points_;
  float inverse_;
  absl::flat_hash_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace binpose

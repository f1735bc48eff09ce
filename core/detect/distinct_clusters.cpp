#include "core/detect/distinct_clusters.h"

#include <array>

namespace binpose {
namespace {

/// Clusters found by place, in a list per cell; x and y are wrapped, so that a list may hold distant ones as well.
class ClusterGrid {
 public:
  explicit ClusterGrid(float side) : inverse_(1 / side) { last_.fill(-1); }

  /// Whether `holds(i)` for a cluster within a cell's side of a place; some others are asked about, too.
  template <typename Predicate>
  bool any_around(const Eigen::Vector3f& place, Predicate&& holds) const {
    const Eigen::Array2i c = cell(place);
    for (int k = 0; k < 9; ++k) {
      for (int i = last_[list(c.x() + k % 3 - 1, c.y() + k / 3 - 1)]; i >= 0; i = before_[i]) {
        if (holds(i)) return true;
      }
    }
    return false;
  }
  /// The next cluster, counted from 0.
  void insert(const Eigen::Vector3f& place) {
    const Eigen::Array2i c = cell(place);
    int& last = last_[list(c.x(), c.y())];
    before_.push_back(last);
    last = static_cast<int>(before_.size()) - 1;
  }

 private:
  static constexpr int kSide = 32;
  Eigen::Array2i cell(const Eigen::Vector3f& p) const {
    return (p.head<2>().array() * inverse_).floor().max(-1e6F).min(1e6F).cast<int>();
  }
  static int list(int x, int y) { return (y & (kSide - 1)) * kSide + (x & (kSide - 1)); }

  float inverse_;
  std::array<int, kSide * kSide> last_;  // cluster of each list, or -1
  std::vector<int> before_;              // of each cluster: the one before it in its list, or -1
};

}  // namespace

std::vector<PoseCluster> distinct_clusters(const std::vector<PoseCluster>& clusters, const ClusterOptions& options) {
  const SamePose same_pose(options);
  std::vector<PoseCluster> kept;
  ClusterGrid grid(options.radius);
  for (const PoseCluster& candidate : clusters) {
    if (static_cast<int>(kept.size()) >= options.most) break;
    const bool repeats = grid.any_around(candidate.centre, [&](int i) { return same_pose(kept[i], candidate); });
    if (repeats) continue;
    grid.insert(candidate.centre);
    kept.push_back(candidate);
  }
  return kept;
}

}  // namespace binpose

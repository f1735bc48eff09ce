#include "core/detect/thin_clusters.h"

#include <array>

namespace binpose {
namespace {

/// Clusters found by place, in a list per cell; x and y are wrapped, so that a list may hold distant ones as well.
class ClusterGrid {
 public:
  explicit ClusterGrid(float side) : inverse_(1 / side) { last_.fill(-1); }

  /// Calls `use(i)` for each cluster within a cell's side of a place, and some others, while it returns true.
  template <typename Use>
  void for_each_around(const Eigen::Vector3f& place, Use&& use) const {
    const Eigen::Array2i c = cell(place);
    for (int k = 0; k < 9; ++k) {
      for (int i = last_[list(c.x() + k % 3 - 1, c.y() + k / 3 - 1)]; i >= 0; i = before_[i]) {
        if (!use(i)) return;
      }
    }
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

std::vector<PoseCluster> thin_clusters(const std::vector<PoseCluster>& clusters, const ClusterOptions& options) {
  const SamePose same_pose(options);
  std::vector<PoseCluster> kept;
  ClusterGrid grid(options.neighbourhood);
  for (const PoseCluster& candidate : clusters) {
    if (static_cast<int>(kept.size()) >= options.most) break;
    int around = 0;
    bool repeats = false;
    grid.for_each_around(candidate.centre, [&](int i) {
      const PoseCluster& other = kept[i];
      if ((other.centre - candidate.centre).squaredNorm() > options.neighbourhood * options.neighbourhood) return true;
      ++around;
      repeats = same_pose(other, candidate);
      return !repeats && around < options.most_per_neighbourhood;
    });
    if (repeats || around >= options.most_per_neighbourhood) continue;
    grid.insert(candidate.centre);
    kept.push_back(candidate);
  }
  return kept;
}

}  // namespace binpose

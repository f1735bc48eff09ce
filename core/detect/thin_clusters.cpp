#include "core/detect/thin_clusters.h"

#include <array>
#include <cstdint>

namespace binpose {
namespace {

/// Clusters found by place. A cluster lies in the buckets of its own cell and of the 8 around it, x and y wrapped, so
/// that one bucket holds all that lie within a cell's side of a place, and some that don't.
class ClusterGrid {
 public:
  explicit ClusterGrid(float side) : inverse_(1 / side) {}

  const std::vector<std::uint32_t>& around(const Eigen::Vector3f& place) const {
    const Eigen::Array2i c = cell(place);
    return buckets_[bucket(c.x(), c.y())];
  }
  void insert(const Eigen::Vector3f& place, std::uint32_t index) {
    const Eigen::Array2i c = cell(place);
    for (int i = 0; i < 9; ++i) buckets_[bucket(c.x() + i % 3 - 1, c.y() + i / 3 - 1)].push_back(index);
  }

 private:
  static constexpr int kSide = 32;
  Eigen::Array2i cell(const Eigen::Vector3f& p) const {
    return (p.head<2>().array() * inverse_).floor().max(-1e6F).min(1e6F).cast<int>();
  }
  static int bucket(int x, int y) { return (y & (kSide - 1)) * kSide + (x & (kSide - 1)); }

  float inverse_;
  std::array<std::vector<std::uint32_t>, kSide * kSide> buckets_;
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
    for (const std::uint32_t i : grid.around(candidate.centre)) {
      const PoseCluster& other = kept[i];
      if ((other.centre - candidate.centre).squaredNorm() > options.neighbourhood * options.neighbourhood) continue;
      ++around;
      repeats = repeats || same_pose(other, candidate);
      if (repeats || around >= options.most_per_neighbourhood) break;
    }
    if (repeats || around >= options.most_per_neighbourhood) continue;
    grid.insert(candidate.centre, static_cast<std::uint32_t>(kept.size()));
    kept.push_back(candidate);
  }
  return kept;
}

}  // namespace binpose

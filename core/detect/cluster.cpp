#include "core/detect/cluster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "core/detect/distinct_clusters.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// Side of a rotation cell in units of the quaternion's components: neighbours differ by about 23 degrees.
constexpr float kRotationCell = 0.2F;
constexpr int kRotationCells = 8;  // cover [-0.8, 0.8]

constexpr std::size_t kVotesPerTask = 4096;
constexpr std::size_t kSeedsPerTask = 64;

/// Numbers of a pose cell: centre x, y, z, the quaternion's largest component, and the bins of its other three.
struct CellOf {
  static constexpr int kRotationBits = 11;
  Eigen::Array3f origin;
  float inverse_size;
  int bits = 1;  ///< per centre coordinate

  CellOf(std::span<const PoseVote> votes, float size) : inverse_size(1 / size) {
    Eigen::Array3f low = Eigen::Array3f::Constant(INFINITY), high = Eigen::Array3f::Constant(-INFINITY);
    for (const PoseVote& vote : votes) {
      low = low.min(vote.centre.array());
      high = high.max(vote.centre.array());
    }
    origin = low - 1.5F * size;  // room for the neighbours of the outermost cells
    const double cells = ((high - origin) * inverse_size).maxCoeff() + 2;
    bits = std::min(17, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(std::min(cells, 1e5)))));
  }

  Eigen::Array3f centre_coordinates(const Eigen::Vector3f& centre) const {
    return (centre.array() - origin) * inverse_size;
  }
  /// The part of a key that says where, and the part that says how turned; a key is both.
  std::uint64_t centre_key(const Eigen::Array3i& cell) const {
    const std::uint64_t limit = (std::uint64_t{1} << bits) - 1;
    std::uint64_t key = 0;
    for (int i = 0; i < 3; ++i) key = key << bits | std::min<std::uint64_t>(limit, std::max(0, cell[i]));
    return key << kRotationBits;
  }
  static std::uint64_t rotation_key(int largest, const Eigen::Array3i& rotation) {
    auto key = static_cast<unsigned>(largest);
    for (int i = 0; i < 3; ++i) key = key << 3 | static_cast<unsigned>(std::clamp(rotation[i], 0, kRotationCells - 1));
    return key;
  }
  int key_bits() const { return 3 * bits + kRotationBits; }
};

/// The quaternion without its largest component, made positive: near-uniform coordinates of a rotation.
struct RotationCoordinates {
  int largest;
  Eigen::Array3f rest;  // in cells

  explicit RotationCoordinates(const Eigen::Quaternionf& q) {
    const Eigen::Vector4f& c = q.coeffs();
    c.cwiseAbs().maxCoeff(&largest);
    const float sign = c[largest] < 0 ? -1.0F : 1.0F;
    for (int i = 0; i < 3; ++i) rest[i] = sign * c[(largest + 1 + i) & 3] / kRotationCell + 0.5F * kRotationCells;
  }
};

/// Votes that share a cell, summed.
struct Cell {
  std::uint64_t key;
  float weight;
  Eigen::Vector3f centre;      // weighted sum
  Eigen::Vector4f quaternion;  // weighted sum, signs aligned
};

struct KeyedVote {
  std::uint64_t key;
  std::uint32_t vote;
};

/// Sorts by key, equal keys in their order; not to the end when stopped.
void radix_sort(std::vector<KeyedVote>& keyed, int bits, const RunControl& control) {
  constexpr int kDigit = 11;
  std::vector<KeyedVote> other(keyed.size());
  for (int shift = 0; shift < bits && !control.stop.stop_requested(); shift += kDigit) {
    std::array<std::uint32_t, (1 << kDigit) + 1> first = {};
    for (const KeyedVote& k : keyed) ++first[(k.key >> shift & ((1 << kDigit) - 1)) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (const KeyedVote& k : keyed) other[first[k.key >> shift & ((1 << kDigit) - 1)]++] = k;
    keyed.swap(other);
  }
}

void add(Cell& cell, float weight, const Eigen::Vector3f& centre, const Eigen::Vector4f& quaternion) {
  cell.weight += weight;
  cell.centre += weight * centre;
  cell.quaternion += (cell.quaternion.dot(quaternion) < 0 ? -weight : weight) * quaternion;
}

/// The cells that have votes, by key; none when stopped.
std::vector<Cell> sum_by_cell(std::span<const PoseVote> votes, const CellOf& cell_of, const RunControl& control) {
  std::vector<KeyedVote> keyed(votes.size());
  parallel_for_blocks(votes.size(), kVotesPerTask, control.threads, [&](std::size_t i) {
    const RotationCoordinates rotation(votes[i].q_view_model);
    keyed[i] = {cell_of.centre_key(cell_of.centre_coordinates(votes[i].centre).cast<int>()) |
                    CellOf::rotation_key(rotation.largest, rotation.rest.cast<int>()),
                static_cast<std::uint32_t>(i)};
  });
  radix_sort(keyed, cell_of.key_bits(), control);
  if (control.stop.stop_requested()) return {};
  std::vector<Cell> cells;
  for (const KeyedVote& k : keyed) {
    if (cells.empty() || cells.back().key != k.key) {
      cells.push_back({k.key, 0, Eigen::Vector3f::Zero(), Eigen::Vector4f::Zero()});
    }
    const PoseVote& vote = votes[k.vote];
    add(cells.back(), vote.weight, vote.centre, vote.q_view_model.coeffs());
  }
  return cells;
}

/// The cells of most weight, at most `most`, heaviest first; equal ones in their order.
std::vector<std::uint32_t> heaviest(const std::vector<Cell>& cells, std::size_t most) {
  std::vector<std::pair<float, std::uint32_t>> weights;  // negative: heaviest first
  weights.reserve(cells.size());
  for (const Cell& cell : cells) weights.emplace_back(-cell.weight, static_cast<std::uint32_t>(weights.size()));
  if (most < weights.size()) {
    std::nth_element(weights.begin(), weights.begin() + static_cast<std::ptrdiff_t>(most), weights.end());
    weights.resize(most);
  }
  std::sort(weights.begin(), weights.end());
  std::vector<std::uint32_t> indices;
  indices.reserve(weights.size());
  for (const auto& [weight, index] : weights) indices.push_back(index);
  return indices;
}

PoseCluster mean(const Cell& cell) {
  return {cell.centre / cell.weight, Eigen::Quaternionf(Eigen::Vector4f(cell.quaternion.normalized())), cell.weight};
}

/// Finds the cells of a centre. They follow each other in a list sorted by key.
class PoseCellIndex {
 public:
  explicit PoseCellIndex(const std::vector<Cell>& cells) {
    keys_.reserve(cells.size());
    for (const Cell& cell : cells) {
      if (keys_.empty() || (keys_.back() ^ cell.key) >> CellOf::kRotationBits != 0) {
        firsts_.push_back(static_cast<std::uint32_t>(keys_.size()));
      }
      keys_.push_back(cell.key);
    }
    const auto centres = static_cast<std::uint32_t>(firsts_.size());
    firsts_.push_back(static_cast<std::uint32_t>(keys_.size()));
    slots_.assign(std::bit_ceil(std::size_t{2} * centres), kEmpty);
    shift_ = 64 - std::countr_zero(slots_.size());
    for (std::uint32_t i = 0; i < centres; ++i) {
      std::size_t slot = first_slot(keys_[firsts_[i]]);
      while (slots_[slot] != kEmpty) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = i;
    }
  }

  /// Calls `use(i)` for each cell i of a centre whose rotation's bins are those of `low_rotation` or one more.
  template <typename Use>
  void for_each_near(std::uint64_t centre_key, std::uint64_t low_rotation, Use&& use) const {
    constexpr std::uint64_t kOneMore = 0b001'001'001;
    for (std::size_t slot = first_slot(centre_key); slots_[slot] != kEmpty; slot = (slot + 1) & (slots_.size() - 1)) {
      const std::uint32_t first = firsts_[slots_[slot]], end = firsts_[slots_[slot] + 1];
      if ((keys_[first] ^ centre_key) >> CellOf::kRotationBits != 0) continue;
      for (std::uint32_t i = first; i < end; ++i) {
        if (((keys_[i] - (centre_key | low_rotation)) & ~kOneMore) == 0) use(i);
      }
      return;
    }
  }

 private:
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFF;
  std::size_t first_slot(std::uint64_t key) const {
    return (key >> CellOf::kRotationBits) * 0x9E3779B97F4A7C15ULL >> shift_;
  }

  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> firsts_;  // cell of each centre's first rotation, and the end
  std::vector<std::uint32_t> slots_;
  int shift_ = 0;
};

/// A cell with those of the 64 cells around its mean (8 of centre, 8 of rotation) that agree with it.
PoseCluster with_neighbours(const std::vector<Cell>& cells, const PoseCellIndex& index, std::uint32_t seed,
                            const CellOf& cell_of, const SamePose& same_pose) {
  const PoseCluster own = mean(cells[seed]);
  const RotationCoordinates rotation(own.q_view_model);
  const Eigen::Array3i low_cell = (cell_of.centre_coordinates(own.centre) - 0.5F).cast<int>();
  const std::uint64_t low_rotation = CellOf::rotation_key(rotation.largest, (rotation.rest - 0.5F).cast<int>());
  Cell sum = cells[seed];
  for (int i = 0; i < 8; ++i) {
    const Eigen::Array3i cell = low_cell + Eigen::Array3i(i & 1, i >> 1 & 1, i >> 2 & 1);
    index.for_each_near(cell_of.centre_key(cell), low_rotation, [&](std::uint32_t found) {
      if (found == seed) return;
      const PoseCluster other = mean(cells[found]);
      if (!same_pose(own, other)) return;
      add(sum, other.votes, other.centre, other.q_view_model.coeffs());
    });
  }
  return mean(sum);
}

}  // namespace

std::vector<PoseCluster> cluster(std::span<const PoseVote> votes, const ClusterOptions& options,
                                 const RunControl& control) {
  if (votes.empty()) return {};
  const CellOf cell_of(votes, options.radius);
  const std::vector<Cell> cells = sum_by_cell(votes, cell_of, control);
  if (control.stop.stop_requested()) return {};

  const std::vector<std::uint32_t> seeds = heaviest(cells, 2 * static_cast<std::size_t>(options.most));
  const PoseCellIndex index(cells);
  const SamePose same_pose(options);
  std::vector<PoseCluster> merged(seeds.size());
  parallel_for_blocks(seeds.size(), kSeedsPerTask, control.threads, [&](std::size_t i) {
    if (!control.stop.stop_requested()) merged[i] = with_neighbours(cells, index, seeds[i], cell_of, same_pose);
  });
  if (control.stop.stop_requested()) return {};
  std::stable_sort(merged.begin(), merged.end(),
                   [](const PoseCluster& a, const PoseCluster& b) { return a.votes > b.votes; });

  return distinct_clusters(merged, options);
}

}  // namespace binpose

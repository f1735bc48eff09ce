#include "core/detect/cluster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace binpose {
namespace {

/// Side of a rotation cell in units of the quaternion's components: neighbours differ by about 23 degrees.
constexpr float kRotationCell = 0.2F;
constexpr int kRotationCells = 8;  // cover [-0.8, 0.8]

/// Numbers of a pose cell: centre x, y, z, the quaternion's largest component, and the bins of its other three.
struct CellOf {
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
  std::uint64_t key(const Eigen::Array3i& cell, int largest, const Eigen::Array3i& rotation) const {
    const std::uint64_t limit = (std::uint64_t{1} << bits) - 1;
    std::uint64_t key = 0;
    for (int i = 0; i < 3; ++i) key = key << bits | std::min<std::uint64_t>(limit, std::max(0, cell[i]));
    key = key << 2 | static_cast<unsigned>(largest);
    for (int i = 0; i < 3; ++i) key = key << 3 | static_cast<unsigned>(std::clamp(rotation[i], 0, kRotationCells - 1));
    return key;
  }
  int key_bits() const { return 3 * bits + 11; }
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
  for (std::size_t i = 0; i < votes.size(); ++i) {
    const RotationCoordinates rotation(votes[i].q_view_model);
    keyed[i] = {cell_of.key(cell_of.centre_coordinates(votes[i].centre).cast<int>(), rotation.largest,
                            rotation.rest.cast<int>()),
                static_cast<std::uint32_t>(i)};
  }
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

bool same_pose(const PoseCluster& a, const PoseCluster& b, float radius, float half_angle_cosine) {
  return (a.centre - b.centre).squaredNorm() < radius * radius &&
         std::abs(a.q_view_model.coeffs().dot(b.q_view_model.coeffs())) > half_angle_cosine;
}

PoseCluster mean(const Cell& cell) {
  return {cell.centre / cell.weight, Eigen::Quaternionf(Eigen::Vector4f(cell.quaternion.normalized())), cell.weight};
}

/// Finds cells by key.
class CellIndex {
 public:
  explicit CellIndex(const std::vector<Cell>& cells)
      : cells_(cells), slots_(std::bit_ceil(2 * cells.size()), kEmpty), shift_(64 - std::countr_zero(slots_.size())) {
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
      std::size_t slot = first_slot(cells[i].key);
      while (slots_[slot] != kEmpty) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = i;
    }
  }
  const Cell* find(std::uint64_t key) const {
    for (std::size_t slot = first_slot(key); slots_[slot] != kEmpty; slot = (slot + 1) & (slots_.size() - 1)) {
      if (cells_[slots_[slot]].key == key) return &cells_[slots_[slot]];
    }
    return nullptr;
  }

 private:
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFF;
  std::size_t first_slot(std::uint64_t key) const { return key * 0x9E3779B97F4A7C15ULL >> shift_; }

  const std::vector<Cell>& cells_;
  std::vector<std::uint32_t> slots_;
  int shift_;
};

/// A cell with those of the 64 cells around its mean (8 of centre, 8 of rotation) that agree with it.
PoseCluster with_neighbours(const CellIndex& index, const Cell& seed, const CellOf& cell_of,
                            const ClusterOptions& options) {
  const PoseCluster own = mean(seed);
  const RotationCoordinates rotation(own.q_view_model);
  const Eigen::Array3i low_cell = (cell_of.centre_coordinates(own.centre) - 0.5F).cast<int>();
  const Eigen::Array3i low_rotation = (rotation.rest - 0.5F).cast<int>();
  Cell sum = seed;
  for (int i = 0; i < 64; ++i) {
    const Eigen::Array3i cell = low_cell + Eigen::Array3i(i & 1, i >> 1 & 1, i >> 2 & 1);
    const Eigen::Array3i turn = low_rotation + Eigen::Array3i(i >> 3 & 1, i >> 4 & 1, i >> 5 & 1);
    const std::uint64_t key = cell_of.key(cell, rotation.largest, turn);
    if (key == seed.key) continue;
    const Cell* found = index.find(key);
    if (found == nullptr) continue;
    const PoseCluster other = mean(*found);
    if (!same_pose(own, other, options.radius, std::cos(0.5F * options.angle))) continue;
    add(sum, other.votes, other.centre, other.q_view_model.coeffs());
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

  std::vector<std::uint32_t> seeds(cells.size());
  std::iota(seeds.begin(), seeds.end(), 0);
  const std::size_t seed_count = std::min<std::size_t>(seeds.size(), 2 * static_cast<std::size_t>(options.most));
  std::partial_sort(seeds.begin(), seeds.begin() + static_cast<std::ptrdiff_t>(seed_count), seeds.end(),
                    [&](std::uint32_t a, std::uint32_t b) {
                      return cells[a].weight != cells[b].weight ? cells[a].weight > cells[b].weight : a < b;
                    });
  const CellIndex index(cells);
  std::vector<PoseCluster> merged;
  for (std::size_t i = 0; i < seed_count; ++i) {
    if (control.stop.stop_requested()) return {};
    merged.push_back(with_neighbours(index, cells[seeds[i]], cell_of, options));
  }
  std::stable_sort(merged.begin(), merged.end(),
                   [](const PoseCluster& a, const PoseCluster& b) { return a.votes > b.votes; });

  std::vector<PoseCluster> kept;
  for (const PoseCluster& candidate : merged) {
    if (static_cast<int>(kept.size()) >= options.most) break;
    int around = 0;
    bool repeats = false;
    for (const PoseCluster& other : kept) {
      if ((other.centre - candidate.centre).squaredNorm() > options.neighbourhood * options.neighbourhood) continue;
      ++around;
      repeats = repeats || same_pose(other, candidate, options.radius, std::cos(0.5F * options.angle));
    }
    if (!repeats && around < options.most_per_neighbourhood) kept.push_back(candidate);
  }
  return kept;
}

}  // namespace binpose

#include "core/train/shells.h"

#include <algorithm>
#include <numeric>
#include <span>

namespace binpose {
namespace {

/// A triangle's side from vertex `low` to `high`, or back.
struct Side {
  std::uint32_t low, high, opposite;
  std::uint32_t triangle : 31, backward : 1;

  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
  bool repeats(const Side& other) const {
    return same_edge(other) && opposite == other.opposite && backward == other.backward;
  }
};

std::vector<Side> sides_of(const Mesh& mesh, const RunControl& control) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size() && !control.interrupted_at(t); ++t) {
    const auto& corners = mesh.triangles[t];
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = corners[k], to = corners[(k + 1) % 3];
      sides.push_back({std::min(from, to), std::max(from, to), corners[(k + 2) % 3], t, from > to});
    }
  }
  return sides;
}

/// Sorts stably by a key below `key_count`. By counting, so that no mesh is slow and a stop is heeded.
template <typename Key>
void sort_by(Key key, std::size_t key_count, std::vector<Side>& sides, const RunControl& control) {
  std::vector<std::uint32_t> begin(key_count + 1, 0);
  for (const Side& side : sides) ++begin[key(side) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Side> sorted(sides.size());
  for (std::size_t i = 0; i < sides.size() && !control.interrupted_at(i); ++i) {
    sorted[begin[key(sides[i])]++] = sides[i];
  }
  sides = std::move(sorted);
}

/// Takes out the sides that repeat the one before and joins their triangles.
void drop_repeated(std::vector<Side>& sides, DisjointSets& sets) {
  const auto end = std::unique(sides.begin(), sides.end(), [&](const Side& kept, const Side& side) {
    if (kept.repeats(side)) sets.join(kept.triangle, side.triangle, false);
    return kept.repeats(side);
  });
  sides.erase(end, sides.end());
}

}  // namespace

DisjointSets::DisjointSets(std::size_t count) : parent_(count), turned_(count, false) {
  std::iota(parent_.begin(), parent_.end(), 0);
}

DisjointSets::Member DisjointSets::find(std::uint32_t index) {
  bool turned = false;
  while (parent_[index] != index) {
    const std::uint32_t parent = parent_[index];
    // Hangs it on its grandparent: paths get shorter with each look.
    turned_[index] = turned_[index] != turned_[parent];
    parent_[index] = parent_[parent];
    turned = turned != turned_[index];
    index = parent_[index];
  }
  return {index, turned};
}

void DisjointSets::join(std::uint32_t a, std::uint32_t b, bool turned) {
  const Member of_a = find(a), of_b = find(b);
  if (of_a.first == of_b.first) return;
  const std::uint32_t later = std::max(of_a.first, of_b.first);
  parent_[later] = std::min(of_a.first, of_b.first);
  turned_[later] = turned != (of_a.turned != of_b.turned);
}

Shells find_shells(const Mesh& mesh, const RunControl& control) {
  std::vector<Side> sides = sides_of(mesh, control);
  const std::size_t vertex_count = mesh.vertices.size();
  sort_by([](const Side& s) { return 2 * std::size_t{s.opposite} + s.backward; }, 2 * vertex_count, sides, control);
  sort_by([](const Side& s) { return s.high; }, vertex_count, sides, control);
  sort_by([](const Side& s) { return s.low; }, vertex_count, sides, control);
  Shells shells;
  if (control.interrupted()) return shells;
  DisjointSets sets(mesh.triangles.size());
  const std::size_t all = sides.size();
  drop_repeated(sides, sets);
  shells.duplicate_count = (all - sides.size()) / 3;

  std::vector<Side> lone;
  for (std::size_t i = 0, end = 0; i < sides.size() && !control.interrupted_at(i); i = end) {
    while (end < sides.size() && sides[end].same_edge(sides[i])) ++end;
    if (end - i == 1) lone.push_back(sides[i]);
    // Neighbours that agree run along their edge in opposite directions.
    if (end - i == 2) sets.join(sides[i].triangle, sides[i + 1].triangle, sides[i].backward == sides[i + 1].backward);
  }
  shells.first.resize(mesh.triangles.size());
  shells.turned.resize(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size() && !control.interrupted_at(t); ++t) {
    const DisjointSets::Member member = sets.find(t);
    shells.first[t] = member.first;
    shells.turned[t] = member.turned;
  }
  for (const Side& side : lone) {
    const bool backward = side.backward != shells.turned[side.triangle];
    shells.rim.push_back({backward ? side.high : side.low, backward ? side.low : side.high});
  }
  return shells;
}

}  // namespace binpose

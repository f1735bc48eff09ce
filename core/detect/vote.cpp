#include "core/detect/vote.h"

#include <algorithm>
#include <cmath>

#include "core/detect/point_block.h"
#include "core/parallel.h"
#include "core/train/vector_pairs.h"

namespace binpose {
namespace {

constexpr int kStartsPerTask = 32;

using NormalLanes = std::int16_t __attribute__((vector_size(2 * PairTable::kBlock)));

/// Bit i is set when all three normals of pair i agree with the scene's: dot products at least `least`.
unsigned agreeing(const PairTable::Block& block, const std::int16_t (&scene)[9], std::int16_t least) {
  NormalLanes agree = {};
  agree = ~agree;
  for (int k = 0; k < 3; ++k) {
    NormalLanes dot = {};
    for (int c = 0; c < 3; ++c) {
      NormalLanes component;
      __builtin_memcpy(&component, block.normals[3 * k + c], sizeof(component));
      dot += component * scene[3 * k + c];
    }
    agree &= dot >= least;
  }
  using Words = std::uint64_t __attribute__((vector_size(2 * PairTable::kBlock)));
  const auto words = reinterpret_cast<Words>(agree & NormalLanes{1, 2, 4, 8, 16, 32, 64, 128});
  std::uint64_t bits = words[0] | words[1];
  bits |= bits >> 32;
  return (bits | bits >> 16) & 0xFF;
}

/// Scene points at a pair's length from P, and the directions to them.
struct Ring {
  std::vector<int> points;
  PointColumns directions;

  void clear() {
    points.clear();
    directions.clear();
  }
  void add(int point, const Eigen::Vector3f& offset, float distance) {
    points.push_back(point);
    directions.add(offset / distance);
  }
};

/// Adds points [first, last) to the rings around `centre` that they lie on.
BINPOSE_VECTORISED
void add_to_rings(const std::vector<SurfacePoint>& points, const Eigen::Vector3f& centre, int first, int last,
                  const std::vector<float>& lengths, float tolerance, std::vector<Ring>& rings) {
  for (; first < last; first += kLanes) {
    const int count = std::min(kLanes, last - first);
    const SurfaceLanes block([&](int i) -> const SurfacePoint& { return points[first + (i < count ? i : 0)]; });
    const LanePoints offset = block.position - centre;
    const Lanes distance = root(dot(offset, offset));
    for (std::size_t r = 0; r < rings.size(); ++r) {
      for_each_set((distance > 0) & (magnitude(distance - lengths[r]) <= tolerance), count, [&](int lane) {
        rings[r].add(first + lane, points[first + lane].position - centre, distance[lane]);
      });
    }
  }
}

/// Sets `found` to the points of a ring at a right angle to a direction.
BINPOSE_VECTORISED
void find_at_right_angle(const Ring& ring, const Eigen::Vector3f& direction, std::vector<int>& found) {
  found.clear();
  const int count = static_cast<int>(ring.points.size());
  for (int first = 0; first < count; first += kLanes) {
    const LaneInts right = magnitude(dot(ring.directions.load(first), direction)) <= kRightAngleCosine;
    for_each_set(right, count - first, [&](int lane) { found.push_back(ring.points[first + lane]); });
  }
}

/// Forms and matches the pairs of one start point after the other.
class PairMatcher {
 public:
  PairMatcher(const ScenePoints& scene, const DepthMap& map, const Model& model, const DetectParams& params)
      : scene_(scene), map_(map), model_(model), rings_(2 * model.params.pair_lengths.size()) {
    least_ =
        static_cast<std::int16_t>(std::lround(PairTable::kUnit * PairTable::kUnit * std::cos(params.normal_tolerance)));
    double longest = 0;
    for (const PairLengths& lengths : model.params.pair_lengths) {
      longest = std::max({longest, lengths.relative_q1, lengths.relative_q2});
      lengths_.push_back(static_cast<float>(lengths.relative_q1 * model.diameter));
      lengths_.push_back(static_cast<float>(lengths.relative_q2 * model.diameter));
    }
    tolerance_ = static_cast<float>(model.params.relative_length_tolerance * model.diameter);
    longest_ = longest * model.diameter + tolerance_;
  }

  void match(int start, Votes& out) {
    collect_rings(start);
    for (std::size_t scale = 0; scale < model_.params.pair_lengths.size(); ++scale) {
      const Ring &q1s = rings_[2 * scale], &q2s = rings_[2 * scale + 1];
      for (std::size_t a = 0; a < q1s.points.size(); ++a) {
        const PointColumns& directions = q1s.directions;
        find_at_right_angle(q2s, {directions.x[a], directions.y[a], directions.z[a]}, partners_);
        for (const int q2 : partners_) match_pair(static_cast<int>(scale), start, q1s.points[a], q2, out);
      }
    }
  }

 private:
  void collect_rings(int start) {
    for (Ring& ring : rings_) ring.clear();
    const Eigen::Vector3f& p = scene_.points[start].position;
    const double reach = longest_ * map_.focal / std::max(1e-6, p.z() - longest_) + scene_.block_size;
    const float u = map_.focal * p.x() / p.z() + map_.cx, v = map_.focal * p.y() / p.z() + map_.cy;
    const int first_column = std::max(0, static_cast<int>((u - reach) / scene_.block_size));
    const int last_column = std::min(scene_.columns - 1, static_cast<int>((u + reach) / scene_.block_size));
    const int first_row = std::max(0, static_cast<int>((v - reach) / scene_.block_size));
    const int last_row = std::min(scene_.rows - 1, static_cast<int>((v + reach) / scene_.block_size));
    for (int row = first_row; row <= last_row; ++row) {
      const int in_row = row * scene_.columns;
      add_to_rings(scene_.points, p, scene_.first[in_row + first_column], scene_.first[in_row + last_column + 1],
                   lengths_, tolerance_, rings_);
    }
    for (Ring& ring : rings_) ring.directions.pad();
  }

  void match_pair(int scale, int p, int q1, int q2, Votes& out) {
    const SurfacePoint &start = scene_.points[p], &end1 = scene_.points[q1], &end2 = scene_.points[q2];
    const Eigen::Matrix3f M_s = pair_frame(start.position, end1.position, end2.position);
    const PairNormals normals = pair_normals(M_s, start, end1, end2);
    std::int16_t scaled[9];
    for (int i = 0; i < 9; ++i) {
      scaled[i] = static_cast<std::int16_t>(std::lrintf(PairTable::kUnit * normals(i % 3, i / 3)));
    }
    ++out.scene_pairs;
    Eigen::Quaternionf q_view_frame;
    bool have_rotation = false;
    for (const PairTable::Block& block : model_.pair_table.find(scale, model_.pair_table.bins().bin(normals))) {
      for (unsigned bits = agreeing(block, scaled, least_); bits != 0; bits &= bits - 1) {
        const std::uint32_t pair = block.pair[__builtin_ctz(bits)];
        if (pair == PairTable::kNoPair) break;
        if (!have_rotation) q_view_frame = Eigen::Quaternionf(M_s);
        have_rotation = true;
        const PairTable::Vote& vote = model_.pair_table.vote(pair);
        out.votes.push_back({start.position + M_s * vote.centre_in_frame, vote.weight,
                             q_view_frame * vote.rotation_frame_model});  // Eq. (8)
      }
    }
  }

  const ScenePoints& scene_;
  const DepthMap& map_;
  const Model& model_;
  std::vector<Ring> rings_;     // q1 and q2 of each scale
  std::vector<int> partners_;   // of the Q1 at hand
  std::vector<float> lengths_;  // of each ring, metres
  float tolerance_ = 0;
  double longest_ = 0;
  std::int16_t least_ = 0;
};

}  // namespace

Votes concatenate(std::span<const Votes> parts) {
  Votes all;
  std::size_t count = 0;
  for (const Votes& part : parts) count += part.votes.size();
  all.votes.reserve(count);
  for (const Votes& part : parts) {
    all.votes.insert(all.votes.end(), part.votes.begin(), part.votes.end());
    all.scene_pairs += part.scene_pairs;
  }
  return all;
}

Votes vote(const ScenePoints& scene, std::span<const int> starts, const DepthMap& map, const Model& model,
           const DetectParams& params, const RunControl& control) {
  const int tasks = (static_cast<int>(starts.size()) + kStartsPerTask - 1) / kStartsPerTask;
  std::vector<Votes> parts(tasks);
  parallel_for(tasks, control.threads, [&](int task) {
    PairMatcher matcher(scene, map, model, params);
    const std::size_t last = std::min<std::size_t>(starts.size(), (task + 1) * kStartsPerTask);
    for (std::size_t i = task * kStartsPerTask; i < last && !control.interrupted(); ++i) {
      matcher.match(starts[i], parts[task]);
    }
  });
  if (control.stop.stop_requested()) return {};
  return concatenate(parts);
}

}  // namespace binpose

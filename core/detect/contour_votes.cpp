#include "core/detect/contour_votes.h"

#include <algorithm>
#include <cmath>

#include "core/detect/point_block.h"
#include "core/parallel.h"

namespace binpose {
namespace {

constexpr int kBlock = 4;  // pixels: one contour point of each block takes part
constexpr int kPointsPerTask = 64;
constexpr double kGoldenRatio = 0.6180339887498949;

/// The scene's contour points thinned by image block, row by row, their outward directions turned into the tangent
/// plane.
struct ContourGrid {
  int columns, rows;
  std::vector<ContourPoint> points;
  std::vector<int> block;  ///< of each point
  std::vector<int> first;  ///< per block: the first point in it or after it
  PointColumns positions, normals;

  explicit ContourGrid(const DepthMap& map) : columns(map.width / kBlock + 1), rows(map.height / kBlock + 1) {
    std::vector<int> contour_of(static_cast<std::size_t>(columns) * rows, -1);
    for (std::size_t i = 0; i < map.contours.size(); ++i) {
      const int pixel = map.pixel_of(map.contours[i].position);
      if (pixel < 0 || map.background[pixel] || in_plane(map.contours[i]).norm() < 0.5F) continue;
      int& slot =
          contour_of[static_cast<std::size_t>(pixel / map.width / kBlock) * columns + pixel % map.width / kBlock];
      if (slot < 0) slot = static_cast<int>(i);
    }
    for (std::size_t i = 0; i < contour_of.size(); ++i) {
      first.push_back(static_cast<int>(points.size()));
      if (contour_of[i] >= 0) add(map.contours[contour_of[i]], static_cast<int>(i));
    }
    first.push_back(static_cast<int>(points.size()));
    positions.pad();
    normals.pad();
  }

 private:
  static Eigen::Vector3f in_plane(const ContourPoint& c) { return c.outward - c.normal * c.normal.dot(c.outward); }

  void add(ContourPoint contour, int at) {
    contour.outward = in_plane(contour).normalized();
    points.push_back(contour);
    block.push_back(at);
    positions.add(contour.position);
    normals.add(contour.normal);
  }
};

/// Limits of a pair in metres; see contour_frame().
struct PairLimits {
  float shortest, longest, flatness;
};

/// Adds to `found` which points of [first, last) may make a pair with point `a`: contour_frame()'s test, eight at a
/// time.
BINPOSE_VECTORISED
void find_partners(const ContourGrid& grid, int a, int first, int last, const PairLimits& limits,
                   std::vector<int>& found) {
  const Eigen::Vector3f &p = grid.points[a].position, &n = grid.points[a].normal;
  for (int b = first; b < last; b += kLanes) {
    const LanePoints line = grid.positions.load(b) - p, normal = grid.normals.load(b);
    const Lanes sq_distance = dot(line, line);
    const LaneInts pairs = (sq_distance >= limits.shortest * limits.shortest) &
                           (sq_distance <= limits.longest * limits.longest) &
                           (magnitude(dot(line, n)) <= limits.flatness) &
                           (magnitude(dot(line, normal)) <= limits.flatness) & (dot(normal, n) >= kSameNormalCosine);
    for_each_set(pairs, last - b, [&](int lane) { found.push_back(b + lane); });
  }
}

/// Votes of all pairs of point `a` with later points at most `reach` blocks away.
void match_point(const ContourGrid& grid, int a, int reach, const Model& model, std::vector<int>& partners,
                 Votes& out) {
  const auto diameter = static_cast<float>(model.diameter);
  const PairLimits limits = {kShortestContourPair * diameter, kLongestContourPair * diameter,
                             kContourFlatness * diameter};
  const int at_row = grid.block[a] / grid.columns, at_column = grid.block[a] % grid.columns;
  partners.clear();
  for (int row = at_row; row <= std::min(grid.rows - 1, at_row + reach); ++row) {
    const int start = row * grid.columns;
    const int first = row == at_row ? a + 1 : grid.first[start + std::max(0, at_column - reach)];
    const int last = grid.first[start + std::min(grid.columns - 1, at_column + reach) + 1];
    find_partners(grid, a, first, last, limits, partners);
  }
  for (const int b : partners) {
    const std::optional<ContourFrame> frame =
        contour_frame(grid.points[a], grid.points[b], limits.shortest, limits.longest, limits.flatness);
    if (!frame) continue;
    ++out.scene_pairs;
    const Eigen::Quaternionf q_view_pair(frame->T_outer_pair.linear());
    model.contour_table.for_each_match(frame->feature, [&](const ContourTable::Vote& vote) {
      out.votes.push_back(
          {frame->T_outer_pair * vote.centre_in_pair, vote.weight, q_view_pair * vote.rotation_pair_model});
    });
  }
}

}  // namespace

Votes contour_votes(const DepthMap& map, const Model& model, double start_share, const RunControl& control) {
  const ContourGrid grid(map);
  const int count = static_cast<int>(grid.points.size());
  const int tasks = (count + kPointsPerTask - 1) / kPointsPerTask;
  std::vector<Votes> parts(tasks);
  parallel_for(tasks, control.threads, [&](int task) {
    std::vector<int> partners;
    for (int a = task * kPointsPerTask; a < std::min(count, (task + 1) * kPointsPerTask); ++a) {
      if (control.interrupted()) return;
      if (std::fmod(kGoldenRatio * a, 1.0) >= start_share) continue;  // any stretch of the list holds its share
      const double span = kLongestContourPair * model.diameter;
      const double pixels = span * map.focal / std::max(1e-6, grid.points[a].position.z() - span);
      match_point(grid, a, static_cast<int>(std::min(pixels / kBlock, 1e6)) + 1, model, partners, parts[task]);
    }
  });
  if (control.stop.stop_requested()) return {};
  return concatenate(parts);
}

}  // namespace binpose

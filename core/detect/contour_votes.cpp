#include "core/detect/contour_votes.h"

#include <algorithm>

#include "core/parallel.h"

namespace binpose {
namespace {

constexpr int kBlock = 4;  // pixels: one contour point of each block takes part
constexpr int kPointsPerTask = 64;

/// Contour points thinned by image block, with their outward directions turned into the tangent plane.
struct ContourGrid {
  int columns = 0, rows = 0;
  std::vector<ContourPoint> points;
  std::vector<Eigen::Vector2i> block;  // of each point
  std::vector<int> of_block;           // index into points, or -1

  explicit ContourGrid(const DepthMap& map) : columns(map.width / kBlock + 1), rows(map.height / kBlock + 1) {
    of_block.assign(static_cast<std::size_t>(columns) * rows, -1);
    for (ContourPoint contour : map.contours) {
      const int pixel = map.pixel_of(contour.position);
      if (pixel < 0 || map.background[pixel]) continue;
      const Eigen::Vector2i at(pixel % map.width / kBlock, pixel / map.width / kBlock);
      int& slot = of_block[static_cast<std::size_t>(at.y()) * columns + at.x()];
      const Eigen::Vector3f in_plane = contour.outward - contour.normal * contour.normal.dot(contour.outward);
      if (slot >= 0 || in_plane.norm() < 0.5F) continue;
      contour.outward = in_plane.normalized();
      slot = static_cast<int>(points.size());
      points.push_back(contour);
      block.push_back(at);
    }
  }
};

void match_point(const ContourGrid& grid, int a, int reach, const Model& model, Votes& out) {
  const auto diameter = static_cast<float>(model.diameter);
  const float shortest = kShortestContourPair * diameter, longest = kLongestContourPair * diameter,
              flatness = kContourFlatness * diameter;
  const Eigen::Vector2i at = grid.block[a];
  for (int row = at.y(); row <= std::min(grid.rows - 1, at.y() + reach); ++row) {
    // Each pair once: the rest of this row, then the rows below.
    const int first = row == at.y() ? at.x() + 1 : std::max(0, at.x() - reach);
    for (int column = first; column <= std::min(grid.columns - 1, at.x() + reach); ++column) {
      const int b = grid.of_block[static_cast<std::size_t>(row) * grid.columns + column];
      if (b < 0) continue;
      if (!makes_pair(grid.points[a], grid.points[b], shortest, longest, flatness)) continue;
      const std::optional<ContourFrame> frame =
          contour_frame(grid.points[a], grid.points[b], shortest, longest, flatness);
      if (!frame) continue;
      ++out.scene_pairs;
      const Eigen::Quaternionf q_view_pair(frame->T_outer_pair.linear());
      model.contour_table.for_each_match(frame->feature, [&](const ContourTable::Vote& vote) {
        out.votes.push_back(
            {frame->T_outer_pair * vote.centre_in_pair, vote.weight, q_view_pair * vote.rotation_pair_model});
      });
    }
  }
}

}  // namespace

Votes contour_votes(const DepthMap& map, const Model& model, const RunControl& control) {
  const ContourGrid grid(map);
  const int count = static_cast<int>(grid.points.size());
  const int tasks = (count + kPointsPerTask - 1) / kPointsPerTask;
  std::vector<Votes> parts(tasks);
  parallel_for(tasks, control.threads, [&](int task) {
    for (int a = task * kPointsPerTask; a < std::min(count, (task + 1) * kPointsPerTask); ++a) {
      if (control.interrupted()) return;
      const double span = kLongestContourPair * model.diameter;
      const double pixels = span * map.focal / std::max(1e-6, grid.points[a].position.z() - span);
      match_point(grid, a, static_cast<int>(pixels / kBlock) + 1, model, parts[task]);
    }
  });
  if (control.stop.stop_requested()) return {};
  return concatenate(parts);
}

}  // namespace binpose

#include "core/train/sample_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "core/geometry/cell_index.h"

namespace binpose {
namespace {

/// Visits 0..count-1 once each in an order without pattern: steps of a size coprime to the count.
std::vector<std::uint32_t> scrambled_order(std::uint32_t count) {
  std::vector<std::uint32_t> order(count);
  if (count == 0) return order;
  std::uint64_t step = static_cast<std::uint64_t>(0.6180339887498949 * count) | 1;
  while (std::gcd(step, static_cast<std::uint64_t>(count)) != 1) step += 2;
  std::uint64_t at = 0;
  for (std::uint32_t& index : order) {
    index = static_cast<std::uint32_t>(at);
    at = (at + step) % count;
  }
  return order;
}

using Triangle = std::array<Eigen::Vector3f, 3>;

/// The area, along the normal.
Eigen::Vector3d area_vector(const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).cast<double>(); }

double area_of(const Triangle& t) { return area_vector(t).norm(); }

/// The two parts of a triangle that is cut across its longest side.
std::array<Triangle, 2> halves(const Triangle& t) {
  const auto sq_length = [&](int side) { return (t[side] - t[(side + 1) % 3]).squaredNorm(); };
  int longest = 0;
  for (int side = 1; side < 3; ++side) {
    if (sq_length(side) > sq_length(longest)) longest = side;
  }
  const Eigen::Vector3f &from = t[longest], &to = t[(longest + 1) % 3], &opposite = t[(longest + 2) % 3];
  const Eigen::Vector3f middle = (from + to) / 2;
  return {Triangle{from, middle, opposite}, Triangle{middle, to, opposite}};
}

/// A point of a triangle, by the R2 sequence that covers the unit square evenly; folding the square gives the triangle.
Eigen::Vector3f point_in(const Triangle& t, std::size_t serial) {
  double along = std::fmod(0.5 + static_cast<double>(serial) * 0.7548776662466927, 1.0);
  double across = std::fmod(0.5 + static_cast<double>(serial) * 0.5698402909980532, 1.0);
  if (along + across > 1) {
    along = 1 - along;
    across = 1 - across;
  }
  return t[0] + static_cast<float>(along) * (t[1] - t[0]) + static_cast<float>(across) * (t[2] - t[0]);
}

}  // namespace

std::vector<SurfacePoint> scatter(const Mesh& mesh, double spacing, const RunControl& control,
                                  std::vector<std::uint32_t>* triangle_of) {
  std::vector<SurfacePoint> points;
  const double area_per_point = spacing * spacing;
  double owed = 0.5;  // area not yet turned into points, in units of one point
  std::uint64_t piece_count = 0;
  std::vector<Triangle> pieces;
  for (std::uint32_t index = 0; index < mesh.triangles.size(); ++index) {
    const auto& [a, b, c] = mesh.triangles[index];
    pieces = {{mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}};
    const Eigen::Vector3d area = area_vector(pieces.front());
    if (!(area.norm() > 0)) continue;
    const Eigen::Vector3f normal = area.normalized().cast<float>();
    // Piece by piece: a sliver as a whole would bunch its points along itself and leave gaps.
    while (!pieces.empty()) {
      if (control.interrupted_at(piece_count++)) return points;
      const Triangle piece = pieces.back();
      pieces.pop_back();
      const double size = area_of(piece);
      if (size > area_per_point) {
        const auto [first, second] = halves(piece);
        if (std::max(area_of(first), area_of(second)) < size) {  // else the coordinates have too few digits to cut it
          pieces.push_back(second);
          pieces.push_back(first);
          continue;
        }
      }
      for (owed += size / area_per_point; owed >= 1; owed -= 1) {
        points.push_back({point_in(piece, points.size()), normal});
        if (triangle_of) triangle_of->push_back(index);
      }
    }
  }
  return points;
}

std::vector<SurfacePoint> thin_evenly(const std::vector<SurfacePoint>& dense, double distance,
                                      const RunControl& control) {
  const std::vector<std::uint32_t> order = scrambled_order(static_cast<std::uint32_t>(dense.size()));
  std::vector<std::uint32_t> kept;
  std::vector<bool> taken(dense.size(), false);
  for (double coarse = 16 * distance; coarse > 0.9 * distance; coarse /= 2) {
    CellIndex index(dense, static_cast<float>(coarse));
    for (const std::uint32_t i : kept) index.insert(i);
    for (const std::uint32_t i : order) {
      if (control.interrupted()) break;
      if (taken[i] || index.near(dense[i], static_cast<float>(coarse))) continue;
      taken[i] = true;
      kept.push_back(i);
      index.insert(i);
    }
  }
  std::vector<SurfacePoint> result;
  result.reserve(kept.size());
  for (const std::uint32_t i : kept) result.push_back(dense[i]);
  return result;
}

}  // namespace binpose

#include "core/train/sample_surface.h"

#include <Eigen/Geometry>
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

}  // namespace

std::vector<SurfacePoint> scatter(const Mesh& mesh, double spacing, const RunControl& control,
                                  std::vector<std::uint32_t>* triangle_of) {
  std::vector<SurfacePoint> points;
  double owed = 0.5;  // area not yet turned into points, in units of one point
  std::uint64_t serial = 0;
  for (std::uint32_t index = 0; index < mesh.triangles.size(); ++index) {
    const auto& triangle = mesh.triangles[index];
    const Eigen::Vector3f& a = mesh.vertices[triangle[0]];
    const Eigen::Vector3f ab = mesh.vertices[triangle[1]] - a;
    const Eigen::Vector3f ac = mesh.vertices[triangle[2]] - a;
    const Eigen::Vector3f cross = ab.cross(ac);
    const double double_area = cross.cast<double>().norm();
    if (!(double_area > 0)) continue;
    owed += 0.5 * double_area / (spacing * spacing);
    const Eigen::Vector3f normal = (cross.cast<double>() / double_area).cast<float>();
    for (; owed >= 1; owed -= 1, ++serial) {
      if (control.interrupted_at(serial)) return points;
      // The R2 sequence covers the unit square evenly; folding the square gives the triangle.
      double s = std::fmod(0.5 + serial * 0.7548776662466927, 1.0);
      double t = std::fmod(0.5 + serial * 0.5698402909980532, 1.0);
      if (s + t > 1) {
        s = 1 - s;
        t = 1 - t;
      }
      points.push_back({a + static_cast<float>(s) * ab + static_cast<float>(t) * ac, normal});
      if (triangle_of) triangle_of->push_back(index);
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

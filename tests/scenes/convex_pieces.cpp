#include "tests/scenes/convex_pieces.h"

#include <LinearMath/btConvexHullComputer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "tests/scenes/ray_scene.h"

namespace binpose::scenes {
namespace {

constexpr double kOnPlane = 1e-7;   // metres within which a corner counts as lying on a cut
constexpr double kThinnest = 2e-4;  // no cut closer than this to the side of its box
constexpr double kFlat = 1e-6;      // a hull thinner than this holds nothing

struct Polygon {
  std::vector<Eigen::Vector3d> corners;
  Eigen::Vector3d normal;
};

struct Hull {
  std::vector<Eigen::Vector3d> corners;
  std::vector<Eigen::Hyperplane<double, 3>> faces;  // normals outward
};

/// The part of the solid within a box: its surface there, and the hull around it.
struct Cell {
  Eigen::AlignedBox3d box;
  std::vector<Polygon> surface;
  std::optional<Hull> hull;                         ///< none where the box holds no solid
  double gap_volume = 0;                            ///< roughly, between hull and solid
  double gap_height = 0;                            ///< largest height of the hull above the surface
  Eigen::Vector3d worst = Eigen::Vector3d::Zero();  ///< where on the surface that is
};

std::optional<Hull> hull_of(const std::vector<Eigen::Vector3d>& points) {
  btConvexHullComputer computer;
  computer.compute(points.data()->data(), sizeof(Eigen::Vector3d), static_cast<int>(points.size()), 0, 0);
  Hull hull;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int i = 0; i < computer.vertices.size(); ++i) {
    const btVector3& v = computer.vertices[i];
    hull.corners.emplace_back(v.x(), v.y(), v.z());
    centre += hull.corners.back() / computer.vertices.size();
  }
  if (hull.corners.size() < 4) return std::nullopt;
  for (int f = 0; f < computer.faces.size(); ++f) {
    const auto* edge = &computer.edges[computer.faces[f]];
    const Eigen::Vector3d& a = hull.corners[edge->getSourceVertex()];
    const Eigen::Vector3d& b = hull.corners[edge->getTargetVertex()];
    const Eigen::Vector3d& c = hull.corners[edge->getNextEdgeOfFace()->getTargetVertex()];
    Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < kOnPlane * kOnPlane) continue;  // a sliver says nothing about the shape
    normal.normalize();
    if (normal.dot(centre - a) > 0) normal = -normal;
    hull.faces.emplace_back(normal, a);
  }
  for (const auto& face : hull.faces) {
    double thickness = 0;
    for (const auto& corner : hull.corners) thickness = std::max(thickness, -face.signedDistance(corner));
    if (thickness < kFlat) return std::nullopt;
  }
  return hull;
}

double area(const Polygon& polygon) {
  Eigen::Vector3d twice = Eigen::Vector3d::Zero();
  const Eigen::Vector3d& a = polygon.corners.front();
  for (std::size_t i = 2; i < polygon.corners.size(); ++i) {
    twice += (polygon.corners[i - 1] - a).cross(polygon.corners[i] - a);
  }
  return twice.norm() / 2;
}

/// How far from a point of the surface, along its normal, the hull ends.
double height_above(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, const Hull& hull) {
  double height = std::numeric_limits<double>::infinity();
  for (const auto& face : hull.faces) {
    const double slope = face.normal().dot(normal);
    if (slope > 1e-9) height = std::min(height, -face.signedDistance(point) / slope);
  }
  return std::max(height, 0.0);
}

/// Finds hull and gap of a cell. The corners of (solid and box) are the corners of the cut surface, and those
/// corners of the box that lie in the solid.
void measure(Cell& cell, const RayScene& solid) {
  std::vector<Eigen::Vector3d> points;
  for (const Polygon& polygon : cell.surface) {
    points.insert(points.end(), polygon.corners.begin(), polygon.corners.end());
  }
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner = cell.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    const Eigen::Vector3d just_within = corner + 1e-4 * (cell.box.center() - corner);  // corners may lie on a face
    if (solid.inside(just_within)) points.push_back(corner);
  }
  if (points.size() >= 4) cell.hull = hull_of(points);
  if (!cell.hull) return;
  for (const Polygon& polygon : cell.surface) {
    const auto height_at = [&](const Eigen::Vector3d& point) {
      const double height = height_above(point, polygon.normal, *cell.hull);
      if (height > cell.gap_height) cell.gap_height = height, cell.worst = point;
      return height;
    };
    const auto& corners = polygon.corners;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      height_at((corners[i] + corners[(i + 1) % corners.size()]) / 2);
      middle += corners[i] / static_cast<double>(corners.size());
    }
    cell.gap_volume += area(polygon) * height_at(middle);
  }
}

/// Keeps what lies on the side of `plane` that its normal points away from.
std::optional<Polygon> cut(const Polygon& polygon, const Eigen::Hyperplane<double, 3>& plane) {
  std::vector<double> height;
  for (const auto& corner : polygon.corners) height.push_back(plane.signedDistance(corner));
  const auto [low, high] = std::minmax_element(height.begin(), height.end());
  if (*low > -kOnPlane && *high < kOnPlane) {  // lies in the plane: belongs to the side that the solid is on
    return polygon.normal.dot(plane.normal()) > 0 ? std::optional(polygon) : std::nullopt;
  }
  if (*low > -kOnPlane) return std::nullopt;
  Polygon kept{{}, polygon.normal};
  for (std::size_t i = 0; i < height.size(); ++i) {
    const std::size_t j = (i + 1) % height.size();
    if (height[i] < kOnPlane) kept.corners.push_back(polygon.corners[i]);
    if ((height[i] < -kOnPlane && height[j] > kOnPlane) || (height[i] > kOnPlane && height[j] < -kOnPlane)) {
      const double t = height[i] / (height[i] - height[j]);
      kept.corners.emplace_back(polygon.corners[i] + t * (polygon.corners[j] - polygon.corners[i]));
    }
  }
  return kept.corners.size() >= 3 ? std::optional(kept) : std::nullopt;
}

Cell half(const Cell& cell, int axis, double at, bool upper, const RayScene& solid) {
  Cell result;
  result.box = cell.box;
  (upper ? result.box.min() : result.box.max())[axis] = at;
  const Eigen::Vector3d normal = (upper ? -1 : 1) * Eigen::Vector3d::Unit(axis);
  const Eigen::Hyperplane<double, 3> plane(normal, at * Eigen::Vector3d::Unit(axis));
  for (const Polygon& polygon : cell.surface) {
    if (auto kept = cut(polygon, plane)) result.surface.push_back(*std::move(kept));
  }
  measure(result, solid);
  return result;
}

/// The cut, through the worst point or through the middle, that leaves the smallest gap.
std::optional<std::array<Cell, 2>> halve(const Cell& cell, const RayScene& solid) {
  std::optional<std::array<Cell, 2>> best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& through : {cell.worst, Eigen::Vector3d(cell.box.center())}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double at = through[axis];
      if (at - cell.box.min()[axis] < kThinnest || cell.box.max()[axis] - at < kThinnest) continue;
      std::array<Cell, 2> halves{half(cell, axis, at, false, solid), half(cell, axis, at, true, solid)};
      const double gap = halves[0].gap_volume + halves[1].gap_volume;
      if (gap < least) least = gap, best = std::move(halves);
    }
  }
  return best;
}

}  // namespace

std::vector<ConvexPiece> convex_pieces(const Mesh& mesh, double tolerance) {
  RayScene solid;
  solid.add(mesh, Pose::Identity());
  solid.build();

  Cell whole;
  for (const auto& triangle : mesh.triangles) {
    Polygon polygon;
    for (const std::uint32_t i : triangle) {
      polygon.corners.emplace_back(mesh.vertices[i].cast<double>());
      whole.box.extend(polygon.corners.back());
    }
    const auto& c = polygon.corners;
    polygon.normal = (c[1] - c[0]).cross(c[2] - c[0]).normalized();
    whole.surface.push_back(std::move(polygon));
  }
  measure(whole, solid);

  std::vector<ConvexPiece> pieces;
  std::vector<Cell> open{std::move(whole)};
  while (!open.empty()) {
    const Cell cell = std::move(open.back());
    open.pop_back();
    if (!cell.hull) continue;
    std::optional<std::array<Cell, 2>> halves;
    if (cell.gap_height > tolerance) halves = halve(cell, solid);
    if (!halves) {
      pieces.push_back(cell.hull->corners);
      continue;
    }
    for (Cell& part : *halves) open.push_back(std::move(part));
  }
  return pieces;
}

}  // namespace binpose::scenes

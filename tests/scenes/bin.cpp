#include "tests/scenes/bin.h"

#include <LinearMath/btConvexHullComputer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tests/scenes/box_mesh.h"

namespace binpose::scenes {
namespace {

/// Area of the convex hull of the part.
double hull_area(const Mesh& part) {
  btConvexHullComputer hull;
  hull.compute(part.vertices.data()->data(), sizeof(Eigen::Vector3f), static_cast<int>(part.vertices.size()), 0, 0);
  double twice = 0;
  for (int f = 0; f < hull.faces.size(); ++f) {
    const auto* first = &hull.edges[hull.faces[f]];
    const btVector3& a = hull.vertices[first->getSourceVertex()];
    for (const auto* edge = first->getNextEdgeOfFace(); edge != first; edge = edge->getNextEdgeOfFace()) {
      const btVector3& b = hull.vertices[edge->getSourceVertex()];
      const btVector3& c = hull.vertices[edge->getTargetVertex()];
      twice += (b - a).cross(c - a).length();
    }
  }
  return twice / 2;
}

}  // namespace

Bin bin_for(const Mesh& part, int count, double layers) {
  // A convex body seen from a random side shows a quarter of its surface (Cauchy).
  const double shadow = hull_area(part) / 4;
  // Room for one part at least, whichever way it lies.
  const double floor = std::max(count * shadow / layers, 2 * diameter(part) * diameter(part));
  return {.length = std::sqrt(floor * 4 / 3), .width = std::sqrt(floor * 3 / 4), .height = 0.8 * diameter(part)};
}

Mesh bin_mesh(const Bin& bin) {
  const double x = bin.length / 2, y = bin.width / 2, w = bin.wall, h = bin.height;
  Mesh mesh;
  add_box(mesh, {Eigen::Vector3d(-x - w, -y - w, -w), Eigen::Vector3d(x + w, y + w, 0)});
  for (const double side : {-1.0, 1.0}) {
    const double wall_x = side * (x + w / 2), wall_y = side * (y + w / 2);
    add_box(mesh, {Eigen::Vector3d(wall_x - w / 2, -y - w, 0), Eigen::Vector3d(wall_x + w / 2, y + w, h)});
    add_box(mesh, {Eigen::Vector3d(-x, wall_y - w / 2, 0), Eigen::Vector3d(x, wall_y + w / 2, h)});
  }
  return mesh;
}

double diameter(const Mesh& mesh) {
  float squared = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (std::size_t j = i + 1; j < mesh.vertices.size(); ++j) {
      squared = std::max(squared, (mesh.vertices[i] - mesh.vertices[j]).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

}  // namespace binpose::scenes

#include "core/train/mesh_extent.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/geometry/view_sphere.h"
#include "core/model.h"

namespace binpose {
namespace {

/// Area over the square of the diameter, below which there is nothing to sample: a wire 3000 times as long as thick.
constexpr double kLeastRelativeArea = 1e-3;
/// Area over the square of the diameter, above which there is more surface than fits into memory as points; a sphere
/// has 3.1.
constexpr double kMostRelativeArea = 200;
/// Directions in which the outermost vertices are compared; about 6 degrees apart, which misses at most
/// 1 - cos(3 degrees) = 0.14 % of the diameter.
constexpr int kExtremeDirections = 1000;

}  // namespace

absl::Status check_mesh(const Mesh& mesh, const RunControl& control) {
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError("mesh holds 0 triangles; it must hold at least 1.");
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t index : mesh.triangles[t]) {
      if (index >= mesh.vertices.size()) {
        return absl::InvalidArgumentError(absl::StrFormat(
            "mesh triangle %d refers to vertex %d; there are %d vertices.", t, index, mesh.vertices.size()));
      }
      if (!mesh.vertices[index].allFinite()) {
        return absl::InvalidArgumentError(
            absl::StrFormat("mesh vertex %d has a coordinate that is not a finite number.", index));
      }
      if (mesh.vertices[index].lpNorm<Eigen::Infinity>() > kLargestCoordinate) {
        return absl::InvalidArgumentError(
            absl::StrFormat("mesh vertex %d has a coordinate beyond %g m. Check the unit.", index, kLargestCoordinate));
      }
    }
  }
  const MeshExtent extent = mesh_extent(mesh, control);
  if (absl::Status status = control.status(); !status.ok()) return status;
  if (!(extent.diameter >= kSmallestDiameter && extent.diameter <= kLargestDiameter)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("mesh has a diameter of %g m; it must lie in [%g, %g] m. Check the unit.", extent.diameter,
                        kSmallestDiameter, kLargestDiameter));
  }
  const double least_area = kLeastRelativeArea * extent.diameter * extent.diameter;
  if (!(extent.area >= least_area)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "mesh has a surface area of %g square metres; for its diameter of %g m it must be at least %g. Its triangles "
        "are degenerate, or a stray one lies far off.",
        extent.area, extent.diameter, least_area));
  }
  const double most_area = kMostRelativeArea * extent.diameter * extent.diameter;
  if (!(extent.area <= most_area)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "mesh has a surface area of %g square metres; for its diameter of %g m it must be at most %g. Remove inner "
        "structure and doubled faces from the CAD export.",
        extent.area, extent.diameter, most_area));
  }
  return absl::OkStatus();
}

MeshExtent mesh_extent(const Mesh& mesh, const RunControl& control) {
  MeshExtent extent;
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    extent.area += 0.5 * (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a).norm();
    for (const std::uint32_t index : t) used[index] = true;
  }
  extent.box_min = Eigen::Vector3d::Constant(INFINITY);
  extent.box_max = Eigen::Vector3d::Constant(-INFINITY);
  const std::vector<Eigen::Vector3f> directions = view_directions(kExtremeDirections);
  std::vector<float> farthest(directions.size(), -INFINITY);
  std::vector<std::size_t> extreme(directions.size(), 0);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!used[i]) continue;
    extent.box_min = extent.box_min.cwiseMin(mesh.vertices[i].cast<double>());
    extent.box_max = extent.box_max.cwiseMax(mesh.vertices[i].cast<double>());
  }
  // Vertices deep inside cannot be extreme: an end of the diameter is at least a quarter of the longest box side away.
  const Eigen::Vector3f centre = (0.5 * (extent.box_min + extent.box_max)).cast<float>();
  const float inner = 0.25F * static_cast<float>((extent.box_max - extent.box_min).maxCoeff());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f offset = mesh.vertices[i] - centre;
    if (!used[i] || offset.norm() < inner) continue;
    if (control.interrupted()) return extent;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      const float along = directions[d].dot(offset);
      if (along > farthest[d]) {
        farthest[d] = along;
        extreme[d] = i;
      }
    }
  }
  for (std::size_t a = 0; a < extreme.size() && !control.interrupted(); ++a) {
    for (std::size_t b = a + 1; b < extreme.size(); ++b) {
      extent.diameter = std::max(extent.diameter,
                                 static_cast<double>((mesh.vertices[extreme[a]] - mesh.vertices[extreme[b]]).norm()));
    }
  }
  return extent;
}

}  // namespace binpose

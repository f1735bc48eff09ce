#include "core/io/polygon_mesh.h"

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_format.h"

namespace binpose {
namespace {

using Corners = std::span<const std::uint32_t>;

absl::Status check_vertices(const std::vector<Eigen::Vector3f>& vertices) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (vertices[i].allFinite()) continue;
    return absl::InvalidArgumentError(
        absl::StrFormat("Vertex %d of the mesh (counted from 0) is (%g, %g, %g); every coordinate must be finite.", i,
                        vertices[i].x(), vertices[i].y(), vertices[i].z()));
  }
  return absl::OkStatus();
}

absl::Status check_face(std::size_t face, Corners corners, std::size_t vertex_count) {
  if (corners.size() < 3) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "Face %d of the mesh (counted from 0) has %d corners; it must have at least 3.", face, corners.size()));
  }
  for (const std::uint32_t corner : corners) {
    if (corner < vertex_count) continue;
    return absl::InvalidArgumentError(
        absl::StrFormat("Face %d of the mesh uses vertex %d (both counted from 0), but there are %d vertices.", face,
                        corner, vertex_count));
  }
  return absl::OkStatus();
}

/// Whether the triangles (start, i, i + 1) all turn the way of the whole polygon, so that together they fill it.
bool fan_fills(const std::vector<Eigen::Vector3f>& vertices, Corners corners, std::size_t start,
               const Eigen::Vector3d& area) {
  const Eigen::Vector3d apex = vertices[corners[start]].cast<double>();
  const double tolerance = 1e-6 * area.squaredNorm();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    const Eigen::Vector3d a = vertices[corners[(start + i) % corners.size()]].cast<double>() - apex;
    const Eigen::Vector3d b = vertices[corners[(start + i + 1) % corners.size()]].cast<double>() - apex;
    if (a.cross(b).dot(area) < -tolerance) return false;
  }
  return true;
}

/// The corner from which a fan of triangles fills the polygon; every corner of a convex one will do.
std::optional<std::size_t> find_fan_start(const std::vector<Eigen::Vector3f>& vertices, Corners corners) {
  if (corners.size() == 3) return 0;
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  const Eigen::Vector3d origin = vertices[corners[0]].cast<double>();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    area += (vertices[corners[i]].cast<double>() - origin).cross(vertices[corners[i + 1]].cast<double>() - origin);
  }
  for (std::size_t start = 0; start < corners.size(); ++start) {
    if (fan_fills(vertices, corners, start, area)) return start;
  }
  return std::nullopt;
}

/// Collects the vertices that are used, each position once.
class VertexMerger {
 public:
  VertexMerger(const std::vector<Eigen::Vector3f>& from, double scale, std::vector<Eigen::Vector3f>& to)
      : from_(from), scale_(scale), to_(to) {}

  std::uint32_t merged(std::uint32_t index) {
    const Eigen::Vector3f& vertex = from_[index];
    const auto [entry, is_new] =
        seen_.try_emplace({vertex.x(), vertex.y(), vertex.z()}, static_cast<std::uint32_t>(to_.size()));
    if (is_new) to_.emplace_back((vertex.cast<double>() * scale_).cast<float>());
    return entry->second;
  }

 private:
  const std::vector<Eigen::Vector3f>& from_;
  const double scale_;
  std::vector<Eigen::Vector3f>& to_;
  absl::flat_hash_map<std::array<float, 3>, std::uint32_t> seen_;
};

}  // namespace

absl::StatusOr<Mesh> triangulate(const PolygonMesh& polygons, double scale, std::size_t max_triangles,
                                 const RunControl& control) {
  if (polygons.corner_counts.empty()) return absl::InvalidArgumentError("The mesh has no face.");
  if (absl::Status status = check_vertices(polygons.vertices); !status.ok()) return status;
  Mesh mesh;
  mesh.triangles.reserve(polygons.corner_counts.size());
  VertexMerger merger(polygons.vertices, scale, mesh.vertices);
  std::size_t first = 0;
  for (std::size_t face = 0; face < polygons.corner_counts.size(); ++face) {
    const Corners corners = Corners(polygons.corners).subspan(first, polygons.corner_counts[face]);
    first += corners.size();
    if (control.interrupted_at(face)) return control.status();
    if (absl::Status status = check_face(face, corners, polygons.vertices.size()); !status.ok()) return status;
    const std::optional<std::size_t> start = find_fan_start(polygons.vertices, corners);
    if (!start.has_value()) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "Face %d of the mesh (counted from 0) is a concave polygon of %d corners; export the mesh as triangles.",
          face, corners.size()));
    }
    if (mesh.triangles.size() + corners.size() - 2 > max_triangles) {
      return absl::ResourceExhaustedError(absl::StrFormat("The mesh has more than %d triangles.", max_triangles));
    }
    const auto corner = [&](std::size_t i) { return merger.merged(corners[(*start + i) % corners.size()]); };
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
      mesh.triangles.push_back({corner(0), corner(i), corner(i + 1)});
    }
  }
  return mesh;
}

}  // namespace binpose

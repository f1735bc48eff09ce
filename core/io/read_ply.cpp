#include "core/io/read_ply.h"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/io/ply_file.h"
#include "core/io/point_normals.h"

namespace binpose {
namespace {

using Columns = std::array<std::size_t, 3>;

std::optional<Columns> find_columns(const PlyElement& element, const std::array<std::string_view, 3>& names) {
  Columns columns{};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<std::size_t> column = element.find(names[i]);
    if (!column.has_value()) return std::nullopt;
    columns[i] = *column;
  }
  return columns;
}

Eigen::Vector3f vector_of(const PlyRow& row, const Columns& columns) {
  return Eigen::Vector3d(row.numbers[columns[0]], row.numbers[columns[1]], row.numbers[columns[2]]).cast<float>();
}

struct Vertices {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;  ///< empty when the file has none
};

absl::StatusOr<Vertices> read_vertices(const PlyElement& element, std::size_t max_vertices, PlyBody& body,
                                       const RunControl& control) {
  if (element.row_count > max_vertices) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("The PLY file has %d vertices; the limit is %d.", element.row_count, max_vertices));
  }
  const std::optional<Columns> xyz = find_columns(element, {"x", "y", "z"});
  if (!xyz.has_value()) {
    return absl::InvalidArgumentError("The vertices of the PLY file lack one of the properties x, y, z.");
  }
  const std::optional<Columns> normal = find_columns(element, {"nx", "ny", "nz"});
  Vertices vertices;
  vertices.positions.reserve(element.row_count);
  PlyRow row;
  for (std::size_t i = 0; i < element.row_count; ++i) {
    if (control.interrupted_at(i)) return control.status();
    if (absl::Status status = body.read_row(element, std::nullopt, row); !status.ok()) return status;
    vertices.positions.push_back(vector_of(row, *xyz));
    if (normal.has_value()) vertices.normals.push_back(vector_of(row, *normal));
  }
  return vertices;
}

absl::Status append_face(const std::vector<double>& indices, PolygonMesh& mesh) {
  if (indices.size() > kMaxCorners) {
    return absl::InvalidArgumentError(
        absl::StrFormat("A face of the PLY file has %d corners; the limit is %d.", indices.size(), kMaxCorners));
  }
  for (const double index : indices) {
    if (!(index >= 0 && index <= 4294967295.0) || std::floor(index) != index) {
      return absl::InvalidArgumentError(absl::StrFormat("A face of the PLY file has the vertex index %g.", index));
    }
    mesh.corners.push_back(static_cast<std::uint32_t>(index));
  }
  mesh.corner_counts.push_back(static_cast<std::uint8_t>(indices.size()));
  return absl::OkStatus();
}

absl::Status read_faces(const PlyElement& element, std::size_t max_triangles, PlyBody& body, const RunControl& control,
                        PolygonMesh& mesh) {
  if (element.row_count > max_triangles) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("The PLY file has %d faces; the limit is %d.", element.row_count, max_triangles));
  }
  std::optional<std::size_t> list = element.find("vertex_indices", true);
  if (!list.has_value()) list = element.find("vertex_index", true);
  if (!list.has_value()) return absl::InvalidArgumentError("The faces of the PLY file lack the list vertex_indices.");
  PlyRow row;
  for (std::size_t i = 0; i < element.row_count; ++i) {
    if (control.interrupted_at(i)) return control.status();
    if (absl::Status status = body.read_row(element, list, row); !status.ok()) return status;
    if (absl::Status status = append_face(row.list, mesh); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<PolygonMesh> read_ply_mesh(std::string_view bytes, std::size_t max_triangles,
                                          const RunControl& control) {
  const absl::StatusOr<PlyHeader> header = parse_ply_header(bytes);
  if (!header.ok()) return header.status();
  PlyBody body(bytes, *header);
  PolygonMesh mesh;
  for (const PlyElement& element : header->elements) {
    absl::Status status;
    if (element.name == "vertex") {
      absl::StatusOr<Vertices> vertices = read_vertices(element, 3 * max_triangles, body, control);
      if (vertices.ok()) mesh.vertices = std::move(vertices->positions);
      status = vertices.status();
    } else if (element.name == "face") {
      status = read_faces(element, max_triangles, body, control, mesh);
    } else {
      status = body.skip_rows(element, control);
    }
    if (!status.ok()) return status;
  }
  return mesh;
}

absl::StatusOr<PointCloud> read_ply_cloud(std::string_view bytes, double metres_per_unit, std::size_t max_points,
                                          const RunControl& control) {
  const absl::StatusOr<PlyHeader> header = parse_ply_header(bytes);
  if (!header.ok()) return header.status();
  PlyBody body(bytes, *header);
  for (const PlyElement& element : header->elements) {
    if (element.name != "vertex") {
      if (absl::Status status = body.skip_rows(element, control); !status.ok()) return status;
      continue;
    }
    absl::StatusOr<Vertices> vertices = read_vertices(element, max_points, body, control);
    if (!vertices.ok()) return vertices.status();
    PointCloud cloud;
    cloud.points = std::move(vertices->positions);
    cloud.normals = std::move(vertices->normals);
    cloud.width = static_cast<std::uint32_t>(cloud.points.size());
    cloud.height = 1;
    for (Eigen::Vector3f& point : cloud.points) point *= static_cast<float>(metres_per_unit);
    normalize_or_drop_normals(cloud);
    return cloud;
  }
  return absl::InvalidArgumentError("The PLY file has no element \"vertex\".");
}

}  // namespace binpose

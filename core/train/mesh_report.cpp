#include "core/train/mesh_report.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "absl/strings/str_format.h"
#include "core/geometry/cell_index.h"

namespace binpose {
namespace {

// Shares of the diameter.
constexpr double kRimSpacing = 0.003;     // of the points that stand for the rims
constexpr double kGap = 0.008;            // between rims that belong together
constexpr double kShortestRim = 0.1;      // of a hole
constexpr double kMostRimPoints = 10000;  // shreds have endless rims, and all near each other

/// Height over longest side, below which a triangle has no area.
constexpr double kLeastHeight = 1e-6;
/// Volume over area times diameter; a closed sheet of nearly no thickness has no inside.
constexpr double kLeastVolume = 1e-4;

// Shares from which something is worth a warning: less of it moves no pose.
constexpr double kMuchUnseen = 0.05;
constexpr double kMuchAgainstNeighbours = 0.01;
constexpr double kManyTriangles = 0.05;

double length_of(const Mesh& mesh, const std::array<std::uint32_t, 2>& edge) {
  return (mesh.vertices[edge[1]] - mesh.vertices[edge[0]]).cast<double>().norm();
}

/// Evenly spaced points along the rims, their direction in place of the normal.
struct RimPoints {
  std::vector<SurfacePoint> points;
  std::vector<std::uint32_t> rim_of;  ///< per point: least vertex of the connected rim
};

RimPoints scatter_on_rims(const Mesh& mesh, const Shells& shells, double spacing, const RunControl& control) {
  DisjointSets rims(mesh.vertices.size());
  for (const auto& edge : shells.rim) rims.join(edge[0], edge[1], false);
  RimPoints scattered;
  double owed = 0.5;  // length not yet turned into points, in units of one point
  for (std::size_t i = 0; i < shells.rim.size() && !control.interrupted_at(i); ++i) {
    const auto& edge = shells.rim[i];
    const Eigen::Vector3f& from = mesh.vertices[edge[0]];
    const Eigen::Vector3f along = mesh.vertices[edge[1]] - from;
    const double points = length_of(mesh, edge) / spacing;
    double at = (1 - owed) / points;
    for (owed += points; owed >= 1; owed -= 1, at += 1 / points) {
      scattered.points.push_back({from + static_cast<float>(at) * along, along.normalized()});
      scattered.rim_of.push_back(rims.find(edge[0]).first);
    }
  }
  return scattered;
}

void find_holes(const Mesh& mesh, const Shells& shells, double diameter, const RunControl& control,
                MeshReport& report) {
  double total = 0;
  for (const auto& edge : shells.rim) total += length_of(mesh, edge);
  const double spacing = std::max(kRimSpacing * diameter, total / kMostRimPoints);
  const RimPoints rims = scatter_on_rims(mesh, shells, spacing, control);
  const float gap = static_cast<float>(kGap / kRimSpacing * spacing);
  CellIndex index(rims.points, gap);
  index.insert_all(control);

  struct Hole {
    std::size_t points = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  };
  std::map<std::uint32_t, Hole> holes;
  for (std::size_t i = 0; i < rims.points.size() && !control.interrupted(); ++i) {
    const SurfacePoint& point = rims.points[i];
    // A surface that goes on here has its rim running the other way.
    if (index.near({point.position, -point.normal}, gap)) continue;
    Hole& hole = holes[rims.rim_of[i]];
    ++hole.points;
    hole.sum += point.position.cast<double>();
  }
  std::size_t longest = 0;
  for (const auto& [rim, hole] : holes) {
    const double length = static_cast<double>(hole.points) * spacing;
    if (length < kShortestRim * diameter) continue;
    ++report.hole_count;
    report.rim_length += length;
    if (hole.points <= longest) continue;
    longest = hole.points;
    report.largest_hole = hole.sum / static_cast<double>(hole.points);
  }
}

/// Areas by shell and way of winding, and what follows from them.
void examine_winding(const Mesh& mesh, const Shells& shells, double diameter, const RunControl& control,
                     MeshReport& report) {
  struct Side {
    double area = 0;
    std::size_t triangles = 0;
  };
  std::vector<std::array<Side, 2>> sides(mesh.triangles.size());
  const Eigen::Vector3d origin = mesh.vertices[mesh.triangles[0][0]].cast<double>();
  double area = 0, volume = 0;
  for (std::size_t t = 0; t < mesh.triangles.size() && !control.interrupted_at(t); ++t) {
    const Eigen::Vector3d a = mesh.vertices[mesh.triangles[t][0]].cast<double>() - origin;
    const Eigen::Vector3d b = mesh.vertices[mesh.triangles[t][1]].cast<double>() - origin;
    const Eigen::Vector3d c = mesh.vertices[mesh.triangles[t][2]].cast<double>() - origin;
    const double double_area = (b - a).cross(c - a).norm();
    const double longest = std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
    if (double_area <= kLeastHeight * longest) ++report.without_area;
    area += double_area / 2;
    volume += a.dot(b.cross(c)) / 6;
    Side& side = sides[shells.first[t]][shells.turned[t]];
    side.area += double_area / 2;
    ++side.triangles;
  }
  double against = 0;
  for (const auto& [kept, turned] : sides) {
    const Side& minority = turned.area > kept.area ? kept : turned;
    against += minority.area;
    report.against_neighbours += minority.triangles;
  }
  report.share_against_neighbours = area > 0 ? against / area : 0;
  report.inside_out =
      report.hole_count == 0 && report.against_neighbours == 0 && volume < -kLeastVolume * area * diameter;
}

double percent(double share) { return 100 * share; }

}  // namespace

MeshReport examine_mesh(const Mesh& mesh, const Shells& shells, double diameter, const RunControl& control) {
  MeshReport report;
  report.triangle_count = mesh.triangles.size();
  report.duplicates = shells.duplicate_count;
  if (!control.interrupted()) find_holes(mesh, shells, diameter, control, report);
  if (!control.interrupted()) examine_winding(mesh, shells, diameter, control, report);
  return report;
}

std::vector<std::string> mesh_warnings(const MeshReport& report, double unseen_share) {
  std::vector<std::string> warnings;
  const double many = kManyTriangles * static_cast<double>(report.triangle_count);
  if (report.hole_count > 0) {
    const Eigen::Vector3d at_mm = 1e3 * report.largest_hole;
    warnings.push_back(absl::StrFormat(
        "The mesh is open: %d hole(s) with %.3g mm of rim in all, the largest around (%.1f, %.1f, %.1f) mm. A surface "
        "without a back is found from one side only; export the part as a closed solid.",
        report.hole_count, 1e3 * report.rim_length, at_mm.x(), at_mm.y(), at_mm.z()));
  }
  if (unseen_share >= kMuchUnseen) {
    warnings.push_back(
        absl::StrFormat("%.0f %% of the mesh's surface can't be seen from outside. It takes time and memory but "
                        "changes no pose; if this is an assembly, export its outer shape alone.",
                        percent(unseen_share)));
  }
  if (report.share_against_neighbours >= kMuchAgainstNeighbours) {
    warnings.push_back(absl::StrFormat(
        "%d triangles (%.0f %% of the area) are wound against their neighbours. Training turned them; should parts be "
        "missed, unify the normals in the CAD system.",
        report.against_neighbours, percent(report.share_against_neighbours)));
  }
  if (report.inside_out) {
    warnings.emplace_back(
        "The mesh is wound inside out. Training turned it; for other programs flip its normals in the CAD system.");
  }
  if (static_cast<double>(report.without_area) >= many) {
    warnings.push_back(absl::StrFormat(
        "%d of %d triangles have no area. Were the coordinates rounded? Export with more digits, or in millimetres.",
        report.without_area, report.triangle_count));
  }
  if (static_cast<double>(report.duplicates) >= many) {
    warnings.push_back(
        absl::StrFormat("%d of %d triangles are there more than once. Does the CAD model hold the same body twice?",
                        report.duplicates, report.triangle_count));
  }
  return warnings;
}

}  // namespace binpose

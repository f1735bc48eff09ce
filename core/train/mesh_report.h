#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/run_control.h"
#include "core/train/shells.h"

namespace binpose {

/// What is wrong with a mesh. Lengths in metres, positions in the model frame; a share is one of the triangles' area.
struct MeshReport {
  std::size_t triangle_count = 0;
  std::size_t hole_count = 0;
  double rim_length = 0;                                   ///< of all holes
  Eigen::Vector3d largest_hole = Eigen::Vector3d::Zero();  ///< middle of the hole with the longest rim
  std::size_t against_neighbours = 0;                      ///< triangles wound against most of their shell
  double share_against_neighbours = 0;
  bool inside_out = false;       ///< closed, its winding agrees, but shows the inside
  std::size_t without_area = 0;  ///< triangles
  std::size_t duplicates = 0;    ///< triangles
};

/// Examines a mesh that check_mesh() accepts.
///
/// A hole is a rim that is open for at least a tenth of the diameter. Where two rims face each other at less than 0.8 %
/// of it, surfaces only meet without sharing vertices, as CAD systems that mesh face by face leave them: no hole.
///
/// @param diameter  metres.
/// @return          of no use when `control` interrupts.
MeshReport examine_mesh(const Mesh& mesh, const Shells& shells, double diameter, const RunControl& control = {});

/// What of it may matter to detection, one sentence or two each; none about a sound mesh.
///
/// @param unseen_share  of the surface, which no viewpoint shows.
std::vector<std::string> mesh_warnings(const MeshReport& report, double unseen_share);

}  // namespace binpose

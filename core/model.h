#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/contour_pair.h"
#include "core/geometry/depth_map.h"
#include "core/geometry/pose.h"
#include "core/geometry/view_sphere.h"
#include "core/pair_table.h"
#include "core/params.h"
#include "core/run_control.h"
#include "core/symmetry.h"
#include "core/vector_pair.h"

namespace binpose {

// Limits of a model's diameter: wide enough that a mesh in the wrong unit is trained, with a warning.
inline constexpr double kSmallestDiameter = 1e-6;
inline constexpr double kLargestDiameter = 1e4;
/// Limit of a model's coordinates and of every other number in it: single precision holds four such, multiplied.
inline constexpr double kLargestCoordinate = 1e8;

/// Spacing of Model::surface, as a share of the diameter.
inline constexpr double kRelativeSurfaceSpacing = 0.015;

/// All that training produced; immutable once built and shared between threads. io/model_file.h saves the stored
/// members; derive() rebuilds the others.
struct Model {
  // Stored. Model frame, metres.
  TrainParams params;
  double diameter = 0;  ///< largest distance between two vertices
  Eigen::Vector3d box_min = Eigen::Vector3d::Zero();
  Eigen::Vector3d box_max = Eigen::Vector3d::Zero();
  std::vector<SurfacePoint> surface;                ///< evenly spaced, progressive: any prefix is evenly spread as well
  std::vector<ViewMask> visibility;                 ///< per surface point: the viewpoints that see it [Eq. 5]
  std::vector<std::vector<ContourPoint>> outlines;  ///< per viewpoint: where what it sees of the part ends
  std::vector<SurfacePoint> pair_points;
  std::vector<VectorPair> pairs;             ///< the selected pairs, best first; indices into `pair_points`
  std::vector<float> pair_weights;           ///< of a vote of each pair
  std::vector<ContourPoint> contour_points;  ///< outward directions in the tangent plane
  std::vector<ContourPair> contour_pairs;    ///< the selected ones, best first; indices into `contour_points`
  std::vector<float> contour_weights;        ///< of a vote of each contour pair
  Symmetry symmetry;
  std::vector<Pose> similar_poses;           ///< T_model_model: turns by which most of the surface stays on itself
  std::vector<SurfacePoint> telling_points;  ///< those that such a turn takes off the surface; progressive
  double telling_spacing = 0;                ///< its square is the surface that each telling point stands for, metres
  std::vector<ViewMask> telling_visibility;  ///< per telling point: the viewpoints that see it
  std::vector<std::string> warnings;         ///< what is odd about the mesh, one sentence each

  // Derived.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();      ///< of the bounding box: the point that is voted for
  std::vector<Eigen::Vector3f> viewpoints;               ///< unit directions from the part to the viewer
  std::vector<std::vector<std::uint16_t>> visible_from;  ///< per viewpoint: the surface points seen, in their order
  std::vector<std::vector<std::uint16_t>> telling_from;  ///< the same of the telling points
  std::vector<float>
      view_area;  ///< per viewpoint: area of the seen surface across the view, over the mean of all views
  PairTable pair_table;
  ContourTable contour_table;
};

/// Fills the derived members from the stored ones; not all of them when `control` interrupts.
void derive(Model& model, const RunControl& control = {});

/// What a model takes of memory, near enough: without its warnings and the allocator's own.
std::size_t memory_bytes(const Model& model);

}  // namespace binpose

#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/geometry/depth_map.h"
#include "core/model.h"
#include "core/run_control.h"

namespace binpose {

/// All points of a cloud, those that hide behind others among them, found by place. A cloud of several sides tells more
/// of a pose than its depth map shows.
class WholeCloud {
 public:
  /// @param spacing  metres: of points in one cell of this size the first is kept.
  /// @param cell     metres: points are found by cells of this size.
  /// Part of the points when `control` interrupts.
  WholeCloud(const SensorView& view, float spacing, float cell, const RunControl& control = {});

  /// View frame, by cell.
  const std::vector<Eigen::Vector3f>& points() const { return points_; }
  /// Indices of the points inside a box of the model frame, ascending.
  std::vector<std::uint32_t> in_box(const Eigen::AlignedBox3f& box, const Eigen::Isometry3f& T_view_model) const;

 private:
  using Cell = Eigen::Array<std::uint64_t, 3, 1>;
  Cell cell_of(const Eigen::Vector3f& p, float size) const;

  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  float cell_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint64_t> keys_;  // of the points' cells, ascending
};

/// The surface of a model, whichever side is seen, by place.
class WholeSurface {
 public:
  /// Holds a reference to the model.
  explicit WholeSurface(const Model& model);

  /// The surface point nearest to a point of the model frame within `distance` <= reach(), or null.
  const SurfacePoint* nearest(const Eigen::Vector3f& p_model, float distance) const;
  /// Point-to-plane ICP: each point of the cloud is drawn to the surface point next to it. No point of view takes part,
  /// and no normal of the cloud. From within reach(); metres as of `gate`, where a pull ends at last.
  Eigen::Isometry3f refine(const WholeCloud& cloud, const Eigen::Isometry3f& T_view_model, float gate) const;
  /// The points of the cloud that lie within `tolerance` metres of the surface, along its normal; ascending indices.
  std::vector<std::uint32_t> explained(const WholeCloud& cloud, const Eigen::Isometry3f& T_view_model,
                                       float tolerance) const;
  float reach() const;

 private:
  Eigen::Array3i cell_of(const Eigen::Vector3f& p_model) const;

  const Model& model_;
  float cell_;
  Eigen::AlignedBox3f box_;  // with a margin of reach()
  Eigen::Array3i size_;      // cells
  std::vector<int> first_;   // per cell, and after the last
  std::vector<int> sorted_;  // surface points by cell
};

}  // namespace binpose

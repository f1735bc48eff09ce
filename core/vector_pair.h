#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/geometry/surface_point.h"

namespace binpose {

/// A vector pair [paper, Fig. 1]: start point P and end points Q1, Q2, as indices into a list of surface points.
struct VectorPair {
  std::uint16_t p, q1, q2;
  std::uint16_t scale;  ///< index into TrainParams::pair_lengths
};

/// The matrix M of [Eq. 8]: columns along P->Q1, P->Q2 and their cross product, orthonormal. Vectors that are not quite
/// at right angles share the error evenly.
Eigen::Matrix3f pair_frame(const Eigen::Vector3f& p, const Eigen::Vector3f& q1, const Eigen::Vector3f& q2);

/// The normals of P, Q1, Q2 (columns) in the pair's frame. The third row holds s_p, s_q1, s_q2 of [Eq. 1]; the other
/// two rows are what the paper's feature drops: the azimuth of each normal.
using PairNormals = Eigen::Matrix3f;
inline PairNormals pair_normals(const Eigen::Matrix3f& frame, const SurfacePoint& p, const SurfacePoint& q1,
                                const SurfacePoint& q2) {
  PairNormals normals;
  normals.col(0) = frame.transpose() * p.normal;
  normals.col(1) = frame.transpose() * q1.normal;
  normals.col(2) = frame.transpose() * q2.normal;
  return normals;
}

/// The discretisation of [Eq. 2]: each s is binned by its angle acos(s), L bins of `bin_width` radians over [0, pi].
class FeatureBins {
 public:
  explicit FeatureBins(double bin_width);

  int per_axis() const { return per_axis_; }
  int count() const { return per_axis_ * per_axis_ * per_axis_; }

  /// Bin of one cosine, in [0, per_axis). Exact to 1/1024 of the cosine; a table look-up.
  int axis_bin(float s) const {
    const int i = static_cast<int>((s + 1.0F) * (0.5F * kCells));
    return bin_of_cosine_[i < 0 ? 0 : (i > kCells ? kCells : i)];
  }
  /// Bin of a feature f(s_p, s_q1, s_q2), in [0, count).
  int bin(float s_p, float s_q1, float s_q2) const {
    return (axis_bin(s_p) * per_axis_ + axis_bin(s_q1)) * per_axis_ + axis_bin(s_q2);
  }
  int bin(const PairNormals& n) const { return bin(n(2, 0), n(2, 1), n(2, 2)); }

 private:
  static constexpr int kCells = 2048;
  int per_axis_;
  std::uint8_t bin_of_cosine_[kCells + 1];
};

}  // namespace binpose

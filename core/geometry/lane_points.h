#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/lanes.h"
#include "core/geometry/surface_point.h"

namespace binpose {

/// Points in the lanes of vectors, one coordinate each.
struct LanePoints {
  Lanes x, y, z;
};

inline Lanes dot(const LanePoints& a, const LanePoints& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline LanePoints operator-(const LanePoints& a, const LanePoints& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline LanePoints rotate(const Eigen::Isometry3f& T, const LanePoints& p) {
  const Eigen::Matrix4f& m = T.matrix();
  return {m(0, 0) * p.x + m(0, 1) * p.y + m(0, 2) * p.z, m(1, 0) * p.x + m(1, 1) * p.y + m(1, 2) * p.z,
          m(2, 0) * p.x + m(2, 1) * p.y + m(2, 2) * p.z};
}

inline LanePoints transform(const Eigen::Isometry3f& T, const LanePoints& p) {
  const LanePoints turned = rotate(T, p);
  return {turned.x + T(0, 3), turned.y + T(1, 3), turned.z + T(2, 3)};
}

inline Lanes dot(const LanePoints& a, const Eigen::Vector3f& b) { return a.x * b.x() + a.y * b.y() + a.z * b.z(); }
inline LanePoints operator-(const LanePoints& a, const Eigen::Vector3f& b) {
  return {a.x - b.x(), a.y - b.y(), a.z - b.z()};
}

/// Eight surface points, coordinate by coordinate.
struct SurfaceLanes {
  LanePoints position, normal;

  /// @param source  gives the point of each lane; one load takes all of it, and the eight are transposed.
  template <typename Source>
  [[gnu::always_inline]] explicit SurfaceLanes(Source&& source) {
    Lanes row[kLanes];
#pragma GCC unroll 8
    for (int i = 0; i < kLanes; ++i) row[i] = load_lanes(source(i).position.data());
    Lanes low[4], high[4];  // columns 0, 1, 4, 5 and 2, 3, 6, 7 of two rows each
    for (int i = 0; i < 4; ++i) {
      low[i] = __builtin_shufflevector(row[2 * i], row[2 * i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
      high[i] = __builtin_shufflevector(row[2 * i], row[2 * i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
    }
    Lanes column_0_4[2], column_1_5[2], column_2[2], column_3[2];  // of four rows each
    for (int i = 0; i < 2; ++i) {
      column_0_4[i] = __builtin_shufflevector(low[2 * i], low[2 * i + 1], 0, 1, 8, 9, 4, 5, 12, 13);
      column_1_5[i] = __builtin_shufflevector(low[2 * i], low[2 * i + 1], 2, 3, 10, 11, 6, 7, 14, 15);
      column_2[i] = __builtin_shufflevector(high[2 * i], high[2 * i + 1], 0, 1, 8, 9, 4, 5, 12, 13);
      column_3[i] = __builtin_shufflevector(high[2 * i], high[2 * i + 1], 2, 3, 10, 11, 6, 7, 14, 15);
    }
    position.x = __builtin_shufflevector(column_0_4[0], column_0_4[1], 0, 1, 2, 3, 8, 9, 10, 11);
    position.y = __builtin_shufflevector(column_1_5[0], column_1_5[1], 0, 1, 2, 3, 8, 9, 10, 11);
    position.z = __builtin_shufflevector(column_2[0], column_2[1], 0, 1, 2, 3, 8, 9, 10, 11);
    normal.x = __builtin_shufflevector(column_3[0], column_3[1], 0, 1, 2, 3, 8, 9, 10, 11);
    normal.y = __builtin_shufflevector(column_0_4[0], column_0_4[1], 4, 5, 6, 7, 12, 13, 14, 15);
    normal.z = __builtin_shufflevector(column_1_5[0], column_1_5[1], 4, 5, 6, 7, 12, 13, 14, 15);
  }
  static_assert(sizeof(SurfacePoint) == sizeof(Lanes) && sizeof(Eigen::Vector3f) == 3 * sizeof(float));
};

}  // namespace binpose

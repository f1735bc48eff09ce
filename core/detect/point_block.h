#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/depth_map.h"
#include "core/geometry/lanes.h"
#include "core/vector_pair.h"

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

/// Points by coordinate, for reading eight that follow each other.
struct PointColumns {
  std::vector<float> x, y, z;

  void clear() {
    for (std::vector<float>* column : {&x, &y, &z}) column->clear();
  }
  void add(const Eigen::Vector3f& p) {
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
  }
  /// To be called after the last add(): the last points can be read as any others.
  void pad() {
    for (std::vector<float>* column : {&x, &y, &z}) column->resize(column->size() + kLanes);
  }
  [[gnu::always_inline]] LanePoints load(std::size_t first) const {
    return {load_lanes(&x[first]), load_lanes(&y[first]), load_lanes(&z[first])};
  }
};

/// Three coordinates of points that come one by one, until they are loaded into lanes.
struct LaneBuffer {
  alignas(sizeof(Lanes)) float x[kLanes], y[kLanes], z[kLanes];

  [[gnu::always_inline]] void set(int lane, const Eigen::Vector3f& p) {
    x[lane] = p.x();
    y[lane] = p.y();
    z[lane] = p.z();
  }
  [[gnu::always_inline]] LanePoints load() const { return {load_lanes(x), load_lanes(y), load_lanes(z)}; }
};

/// The pixels that points fall on, or -1.
[[gnu::always_inline]] inline LaneInts pixels_of(const DepthMap& map, const LanePoints& p) {
  const Lanes scale = map.focal / p.z;
  const Lanes u = p.x * scale + (map.cx + 0.5F), v = p.y * scale + (map.cy + 0.5F);
  const LaneInts inside =
      (p.z > 0) & (u >= 0) & (v >= 0) & (u < static_cast<float>(map.width)) & (v < static_cast<float>(map.height));
  const Lanes zero = {};
  const LaneInts pixel = __builtin_convertvector(inside ? v : zero, LaneInts) * map.width +
                         __builtin_convertvector(inside ? u : zero, LaneInts);
  return inside ? pixel : LaneInts{} - 1;
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

/// Surface points under a pose, and what the sensor measured where they fall; eight at a time.
struct PointBlock {
  LanePoints point, normal;              ///< of the model, view frame; lanes without a point have z = -1
  LanePoints scene_point, scene_normal;  ///< measured there; z = 0: nothing measured, no normal
  LaneInts pixel;                        ///< where, or -1

  /// Takes up to eight points of a list of indices.
  [[gnu::always_inline]] void load(const std::vector<SurfacePoint>& surface, std::span<const std::uint16_t> indices,
                                   const Eigen::Isometry3f& T_view_model) {
    const int count = static_cast<int>(std::min<std::size_t>(kLanes, indices.size()));
    const SurfaceLanes model([&](int i) -> const SurfacePoint& { return surface[indices[i < count ? i : 0]]; });
    point = transform(T_view_model, model.position);
    normal = rotate(T_view_model, model.normal);
    for (int i = count; i < kLanes; ++i) point.z[i] = -1;
  }

  /// Finds the pixel of each point and takes what was measured there.
  [[gnu::always_inline]] void look_up(const DepthMap& map) {
    pixel = pixels_of(map, point);
    const SurfaceLanes scene([&](int i) -> const SurfacePoint& { return map.pixels[std::max(0, pixel[i])]; });
    scene_point = scene.position;
    scene_normal = scene.normal;
    const Lanes zero = {};
    scene_point.z = pixel >= 0 ? scene_point.z : zero;
    scene_normal.z = pixel >= 0 ? scene_normal.z : zero;
  }
};

}  // namespace binpose

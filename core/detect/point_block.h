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
  [[gnu::always_inline]] LanePoints load() const {
    LanePoints p;
    __builtin_memcpy(&p.x, x, sizeof(x));
    __builtin_memcpy(&p.y, y, sizeof(y));
    __builtin_memcpy(&p.z, z, sizeof(z));
    return p;
  }
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

/// Surface points under a pose, and what the sensor measured where they fall; eight at a time.
struct PointBlock {
  LanePoints point, normal;              ///< of the model, view frame; lanes without a point have z = -1
  LanePoints scene_point, scene_normal;  ///< measured there; z = 0: nothing measured, no normal
  LaneInts pixel;                        ///< where, or -1

  /// Takes up to eight points of a list of indices.
  [[gnu::always_inline]] void load(const std::vector<SurfacePoint>& surface, std::span<const std::uint16_t> indices,
                                   const Eigen::Isometry3f& T_view_model) {
    const int count = static_cast<int>(std::min<std::size_t>(kLanes, indices.size()));
    LaneBuffer positions, normals;
    for (int i = 0; i < kLanes; ++i) {
      const SurfacePoint& source = surface[indices[i < count ? i : 0]];
      positions.set(i, source.position);
      normals.set(i, source.normal);
    }
    point = transform(T_view_model, positions.load());
    normal = rotate(T_view_model, normals.load());
    for (int i = count; i < kLanes; ++i) point.z[i] = -1;
  }

  /// Finds the pixel of each point and takes what was measured there.
  [[gnu::always_inline]] void look_up(const DepthMap& map) {
    pixel = pixels_of(map, point);
    LaneBuffer positions, normals;
    for (int i = 0; i < kLanes; ++i) {
      const int at = std::max(0, pixel[i]);
      positions.set(i, map.points[at]);
      normals.set(i, map.normals[at]);
    }
    scene_point = positions.load();
    scene_normal = normals.load();
    const Lanes zero = {};
    scene_point.z = pixel >= 0 ? scene_point.z : zero;
    scene_normal.z = pixel >= 0 ? scene_normal.z : zero;
  }
};

}  // namespace binpose

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/depth_map.h"
#include "core/geometry/lane_points.h"
#include "core/vector_pair.h"

namespace binpose {

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

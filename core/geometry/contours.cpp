#include "core/geometry/contours.h"

#include <Eigen/Geometry>

#include "core/parallel.h"

namespace binpose {
namespace {

constexpr int kWidestGap = 5;  // pixels that may lack a measurement between an edge and what lies behind it
constexpr int kDirections[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};

/// Whether the surface at a pixel ends in a direction.
bool ends(const DepthMap& map, int u, int v, const int (&direction)[2], float step, Unmeasured unmeasured) {
  const int i = v * map.width + u;
  for (int k = 1; k <= kWidestGap; ++k) {
    const int column = u + k * direction[0], row = v + k * direction[1];
    if (column < 0 || row < 0 || column >= map.width || row >= map.height) break;
    const int j = row * map.width + column;
    if (map.measured(j)) {
      return map.pixels[i].normal.dot(map.pixels[j].position - map.pixels[i].position) < -step &&
             map.pixels[j].position.z() > map.pixels[i].position.z();
    }
  }
  return unmeasured == Unmeasured::kFar;
}

/// Whether the surface at a pixel off the image's border goes on in all directions: the common case, told fast.
bool goes_on(const DepthMap& map, int i, float step) {
  const Eigen::Vector3f& n = map.pixels[i].normal;
  const float least = n.dot(map.pixels[i].position) - step;
  for (const auto& direction : kDirections) {
    const Eigen::Vector3f& p = map.pixels[i + direction[1] * map.width + direction[0]].position;
    if (!(p.z() > 0) || n.dot(p) < least) return false;
  }
  return true;
}

/// Where the surface at a pixel ends: the mean of the directions in which it does, zero if it goes on.
Eigen::Vector2f outward_at(const DepthMap& map, int u, int v, float step, Unmeasured unmeasured) {
  Eigen::Vector2f outward = Eigen::Vector2f::Zero();
  for (const auto& direction : kDirections) {
    if (ends(map, u, v, direction, step, unmeasured)) {
      outward += Eigen::Vector2f(static_cast<float>(direction[0]), static_cast<float>(direction[1])).normalized();
    }
  }
  // A sum near zero belongs to a speck or a thread, which has no side.
  return outward.squaredNorm() < 0.5F ? Eigen::Vector2f::Zero() : Eigen::Vector2f(outward.normalized());
}

}  // namespace

void find_contours(DepthMap& map, float step, Unmeasured unmeasured, const RunControl& control) {
  std::vector<Eigen::Vector2f> outward(map.pixels.size(), Eigen::Vector2f::Zero());
  parallel_for(map.height, control.threads, [&](int v) {
    if (control.interrupted()) return;
    for (int u = 0; u < map.width; ++u) {
      const int i = v * map.width + u;
      if (!map.has_normal(i) || map.background[i] != 0) continue;
      const bool inside = u > 0 && v > 0 && u < map.width - 1 && v < map.height - 1;
      if (!inside || !goes_on(map, i, step)) outward[i] = outward_at(map, u, v, step, unmeasured);
    }
  });
  map.contours.clear();
  map.contour_at.assign(map.pixels.size(), -1);
  for (std::size_t i = 0; i < outward.size(); ++i) {
    if (outward[i] == Eigen::Vector2f::Zero()) continue;
    map.contour_at[i] = static_cast<int>(map.contours.size());
    map.contours.push_back({map.pixels[i].position, map.pixels[i].normal, {outward[i].x(), outward[i].y(), 0}});
  }
}

}  // namespace binpose

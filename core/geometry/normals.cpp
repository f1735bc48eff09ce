#include "core/geometry/normals.h"

#include <cmath>

#include "core/parallel.h"

namespace binpose {
namespace {

constexpr float kGrazingCosine = 0.17364818F;  // 80 degrees
constexpr int kFewestNeighbours = 4;           // besides the pixel itself, in a 3 x 3 window
/// Depth step between neighbours, in pixel widths per pixel, beyond which they lie on different surfaces.
constexpr float kSteepest = 3.0F;

/// Sums of a least-squares fit of w = a x + b y + c, relative to the window's centre.
struct PlaneSums {
  float n = 0, x = 0, y = 0, w = 0, xx = 0, xy = 0, yy = 0, xw = 0, yw = 0;

  void add(float dx, float dy, float dw) {
    n += 1;
    x += dx;
    y += dy;
    w += dw;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
    xw += dx * dw;
    yw += dy * dw;
  }

  /// (a, b, dw at the centre); false when the points lie on a line.
  bool solve(Eigen::Vector3f& plane) const {
    const float vxx = xx - x * x / n, vxy = xy - x * y / n, vyy = yy - y * y / n;
    const float vxw = xw - x * w / n, vyw = yw - y * w / n;
    const float det = vxx * vyy - vxy * vxy;
    if (!(det > 0.05F * vxx * vyy) || !(det > 0)) return false;
    const float a = (vxw * vyy - vyw * vxy) / det, b = (vyw * vxx - vxw * vxy) / det;
    plane = {a, b, (w - a * x - b * y) / n};
    return true;
  }
};

Eigen::Vector3f normal_at(const DepthMap& map, int u, int v, int radius) {
  const Eigen::Vector3f& centre = map.points[v * map.width + u];
  const float inverse = 1 / centre.z();
  const float x0 = centre.x() * inverse, y0 = centre.y() * inverse;
  const float step = kSteepest * static_cast<float>(radius) * centre.z() / map.focal;
  PlaneSums sums;
  for (int row = std::max(0, v - radius); row <= std::min(map.height - 1, v + radius); ++row) {
    for (int column = std::max(0, u - radius); column <= std::min(map.width - 1, u + radius); ++column) {
      const Eigen::Vector3f& p = map.points[row * map.width + column];
      if (!(std::abs(p.z() - centre.z()) < step)) continue;
      const float w = 1 / p.z();
      // Scaled so that sums of a fit at any distance stay near 1.
      sums.add((p.x() * w - x0) * map.focal, (p.y() * w - y0) * map.focal, w * centre.z() - 1);
    }
  }
  Eigen::Vector3f plane;
  if (sums.n < kFewestNeighbours + 1 || !sums.solve(plane)) return Eigen::Vector3f::Zero();
  // w z0 = 1 + dw + a focal (x - x0) + b focal (y - y0) is (normal . point) over the plane's distance.
  const float a = plane[0] * map.focal, b = plane[1] * map.focal;
  const Eigen::Vector3f normal = -Eigen::Vector3f(a, b, 1 + plane[2] - a * x0 - b * y0).normalized();
  return -normal.dot(centre) >= kGrazingCosine * centre.norm() ? normal : Eigen::Vector3f::Zero();
}

}  // namespace

void estimate_normals(DepthMap& map, int radius, int threads) {
  parallel_for(map.height, threads, [&](int v) {
    for (int u = 0; u < map.width; ++u) {
      const int i = v * map.width + u;
      map.normals[i] = map.measured(i) ? normal_at(map, u, v, radius) : Eigen::Vector3f::Zero();
    }
  });
}

}  // namespace binpose

#include "core/geometry/normals.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace binpose {
namespace {

constexpr float kGrazingCosine = 0.17364818F;  // 80 degrees
constexpr float kSteadyCosine = 0.5F;          // noise is judged on surfaces within 60 degrees
constexpr int kFewestNeighbours = 4;           // besides the pixel itself, in a 3 x 3 window
/// Depth step between neighbours, in pixel widths per pixel, beyond which they lie on different surfaces.
constexpr float kSteepest = 3.0F;

/// Sums of a least-squares fit of w = a x + b y + c, relative to the window's centre.
struct PlaneSums {
  float n = 0, x = 0, y = 0, w = 0, xx = 0, xy = 0, yy = 0, xw = 0, yw = 0, ww = 0;

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
    ww += dw * dw;
  }

  /// (a, b, dw at the centre) and the standard deviation of w about the plane; false when the points lie on a line.
  bool solve(Eigen::Vector3f& plane, float& deviation) const {
    const float vxx = xx - x * x / n, vxy = xy - x * y / n, vyy = yy - y * y / n;
    const float vxw = xw - x * w / n, vyw = yw - y * w / n;
    const float det = vxx * vyy - vxy * vxy;
    if (!(det > 0.05F * vxx * vyy) || !(det > 0)) return false;
    const float a = (vxw * vyy - vyw * vxy) / det, b = (vyw * vxx - vxw * vxy) / det;
    plane = {a, b, (w - a * x - b * y) / n};
    const float sum_sq = ww - w * w / n - a * vxw - b * vyw;
    deviation = std::sqrt(std::max(0.0F, sum_sq) / std::max(1.0F, n - 3));
    return true;
  }
};

struct Fit {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float deviation = -1;  ///< of the window's points from the plane, along the normal, metres; negative: not known
};

Fit fit_window(const DepthMap& map, int u, int v, int radius) {
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
  Fit fit;
  Eigen::Vector3f plane;
  float deviation = 0;
  if (sums.n < kFewestNeighbours + 1 || !sums.solve(plane, deviation)) return fit;
  // w z0 = 1 + dw + a focal (x - x0) + b focal (y - y0) is (normal . point) over the plane's distance.
  const float a = plane[0] * map.focal, b = plane[1] * map.focal;
  const Eigen::Vector3f normal = -Eigen::Vector3f(a, b, 1 + plane[2] - a * x0 - b * y0).normalized();
  const float cosine = -normal.dot(centre) / centre.norm();
  if (cosine < kGrazingCosine) return fit;
  fit.normal = normal;
  const bool full = sums.n == static_cast<float>((2 * radius + 1) * (2 * radius + 1));
  if (full && cosine > kSteadyCosine) fit.deviation = deviation * centre.z() * cosine;
  return fit;
}

/// The noise that explains the quietest windows: edges and curvature only make others louder.
float noise_of(std::vector<float> deviations) {
  std::erase_if(deviations, [](float d) { return d < 0; });
  if (deviations.empty()) return 0;
  const auto quarter = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 4);
  std::nth_element(deviations.begin(), quarter, deviations.end());
  // A quarter of the windows of 9 points on a plane deviate by less than this share of the noise: sqrt(chi^2_6 / 6).
  constexpr float kQuarterOfNine = 0.76F;
  return *quarter / kQuarterOfNine;
}

}  // namespace

double normal_error(double noise, double pixel_size, int radius) {
  const double side = 2 * radius + 1;
  const double sum_sq_offset = side * side * radius * (radius + 1) / 3;  // of a window's pixels along one axis
  return noise / (pixel_size * std::sqrt(sum_sq_offset));
}

void estimate_normals(DepthMap& map, int radius, const RunControl& control) {
  std::vector<float> deviations(map.points.size(), -1);
  parallel_for(map.height, control.threads, [&](int v) {
    if (control.interrupted()) return;
    for (int u = 0; u < map.width; ++u) {
      const int i = v * map.width + u;
      if (!map.measured(i)) continue;
      const Fit fit = fit_window(map, u, v, radius);
      map.normals[i] = fit.normal;
      deviations[i] = fit.deviation;
    }
  });
  if (control.interrupted()) return;
  map.noise = noise_of(std::move(deviations));
}

}  // namespace binpose

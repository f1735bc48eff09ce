#include "core/geometry/normals.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/geometry/lanes.h"
#include "core/parallel.h"

namespace binpose {
namespace {

constexpr float kSteadyCosine = 0.5F;  // noise is judged on surfaces within 60 degrees
constexpr int kFewestNeighbours = 4;   // besides the pixel itself, in a 3 x 3 window
/// Depth step between neighbours, in pixel widths per pixel, beyond which they lie on different surfaces.
constexpr float kSteepest = 3.0F;
/// A window is plane, whatever its noise, when its points deviate by less, in pixel widths.
constexpr float kFlat = 0.02F;
constexpr float kMuchQuieter = 0.7F;
constexpr float kOnPlane = 2.0F;  // deviations that a point of the plane may be off it

/// The measured points of a map as inverse depth over the image, one array each, with a margin of nothing measured.
struct RayImage {
  int stride, margin;
  std::vector<float> x, y;  ///< tangents of the ray through the point
  std::vector<float> z, w;  ///< depth and inverse depth; 0: nothing measured

  RayImage(const DepthMap& map, int margin, int threads) : stride(map.width + 2 * margin + kLanes), margin(margin) {
    const std::size_t count = static_cast<std::size_t>(stride) * (map.height + 2 * margin);
    for (std::vector<float>* values : {&x, &y, &z, &w}) values->assign(count, 0);
    parallel_for(map.height, threads, [&](int v) {
      for (int u = 0; u < map.width; ++u) {
        const Eigen::Vector3f& p = map.pixels[static_cast<std::size_t>(v) * map.width + u].position;
        if (!(p.z() > 0)) continue;
        const std::size_t i = at(u, v);
        z[i] = p.z();
        w[i] = 1 / p.z();
        x[i] = p.x() * w[i];
        y[i] = p.y() * w[i];
      }
    });
  }
  std::size_t at(int u, int v) const { return static_cast<std::size_t>(v + margin) * stride + u + margin; }
};

/// Sums of a least-squares fit of w = a x + b y + c, relative to the window's centre; eight windows at a time.
struct PlaneSums {
  Lanes n = {}, x = {}, y = {}, w = {}, xx = {}, xy = {}, yy = {}, xw = {}, yw = {}, ww = {};

  [[gnu::always_inline]] void add(const LaneInts& belongs, const Lanes& all_x, const Lanes& all_y, const Lanes& all_w) {
    const Lanes zero = {};
    const Lanes dx = belongs ? all_x : zero, dy = belongs ? all_y : zero, dw = belongs ? all_w : zero;
    n += belongs ? zero + 1 : zero;
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
};

/// A plane w = a x + b y + c and the standard deviation of w about it; `known` is false when the points lie on a line.
struct PlaneFit {
  Lanes a, b, c, deviation;
  LaneInts known;

  [[gnu::always_inline]] explicit PlaneFit(const PlaneSums& s) {
    const Lanes zero = {}, n = s.n > 0 ? s.n : zero + 1;
    const Lanes vxx = s.xx - s.x * s.x / n, vxy = s.xy - s.x * s.y / n, vyy = s.yy - s.y * s.y / n;
    const Lanes vxw = s.xw - s.x * s.w / n, vyw = s.yw - s.y * s.w / n;
    const Lanes det = vxx * vyy - vxy * vxy;
    known = (det > 0.05F * vxx * vyy) & (det > 0) & (s.n >= kFewestNeighbours + 1);
    const Lanes divisor = known ? det : zero + 1;
    a = (vxw * vyy - vyw * vxy) / divisor;
    b = (vyw * vxx - vxw * vxy) / divisor;
    c = (s.w - a * s.x - b * s.y) / n;
    const Lanes sum_sq = s.ww - s.w * s.w / n - a * vxw - b * vyw;
    const Lanes freedom = n > 4 ? n - 3 : zero + 1;
    deviation = root((sum_sq > 0 ? sum_sq : zero) / freedom);
  }
};

/// How far the points of each pixel's window lie off its plane, along the normal, metres; infinite where unknown.
struct Deviations {
  std::vector<float> all, steady;  ///< those of whole windows that face the sensor apart: they tell of its noise

  explicit Deviations(std::size_t count) : all(count, INFINITY), steady(count, INFINITY) {}
};

/// Normals of a row of pixels.
BINPOSE_VECTORISED
void fit_row(DepthMap& map, const RayImage& rays, int v, int radius, Deviations& deviations) {
  const auto whole = static_cast<float>((2 * radius + 1) * (2 * radius + 1));
  const float steepest = kSteepest * static_cast<float>(radius) / map.focal;
  for (int u = 0; u < map.width; u += kLanes) {
    const std::size_t centre = rays.at(u, v);
    const Lanes x0 = load_lanes(&rays.x[centre]), y0 = load_lanes(&rays.y[centre]), z0 = load_lanes(&rays.z[centre]);
    PlaneSums sums;
    for (int row = -radius; row <= radius; ++row) {
      for (int column = -radius; column <= radius; ++column) {
        const std::size_t i = rays.at(u + column, v + row);
        const Lanes z = load_lanes(&rays.z[i]);
        // Scaled so that sums of a fit at any distance stay near 1.
        sums.add((z > 0) & (magnitude(z - z0) < steepest * z0), (load_lanes(&rays.x[i]) - x0) * map.focal,
                 (load_lanes(&rays.y[i]) - y0) * map.focal, load_lanes(&rays.w[i]) * z0 - 1);
      }
    }
    const PlaneFit fit(sums);
    // w z0 = 1 + dw + a focal (x - x0) + b focal (y - y0) is (normal . point) over the plane's distance.
    const Lanes a = fit.a * map.focal, b = fit.b * map.focal, c = 1 + fit.c - a * x0 - b * y0;
    const Lanes length = root(a * a + b * b + c * c);
    const Lanes cosine = (a * x0 + b * y0 + c) / (length * root(x0 * x0 + y0 * y0 + 1));
    const LaneInts good = fit.known & (cosine >= kGrazingCosine);
    const LaneInts steady = good & (sums.n == whole) & (cosine > kSteadyCosine);
    const Lanes off = fit.deviation * z0 * cosine;
    for (int lane = 0; lane < std::min(kLanes, map.width - u); ++lane) {
      const int i = v * map.width + u + lane;
      if (!map.measured(i)) continue;
      const Eigen::Vector3f normal = -Eigen::Vector3f(a[lane], b[lane], c[lane]) / length[lane];
      map.pixels[i].normal = good[lane] != 0 ? normal : Eigen::Vector3f(0, 0, 0);
      if (good[lane] != 0) deviations.all[i] = off[lane];
      if (steady[lane] != 0) deviations.steady[i] = off[lane];
    }
  }
}

/// The noise that explains the quietest windows: edges and curvature only make others louder.
float noise_of(std::vector<float> deviations) {
  std::erase_if(deviations, [](float d) { return std::isinf(d); });
  if (deviations.empty()) return 0;
  const auto quarter = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 4);
  std::nth_element(deviations.begin(), quarter, deviations.end());
  // A quarter of the windows of 9 points on a plane deviate by less than this share of the noise: sqrt(chi^2_6 / 6).
  constexpr float kQuarterOfNine = 0.76F;
  return *quarter / kQuarterOfNine;
}

/// The window around a pixel, its own or one beside it, that describes it best.
int quietest_window(const DepthMap& map, const std::vector<float>& deviations, int u, int v, int radius) {
  const int own = v * map.width + u;
  const float flat = kFlat * map.pixel_size;
  if (deviations[own] < flat) return own;
  float least = kMuchQuieter * deviations[own];
  int quietest = own;
  for (int row = v - radius; row <= v + radius; row += radius) {
    for (int column = u - radius; column <= u + radius; column += radius) {
      if (row < 0 || row >= map.height || column < 0 || column >= map.width) continue;
      const int i = row * map.width + column;
      if (!(deviations[i] < least)) continue;
      const float off = map.pixels[i].normal.dot(map.pixels[own].position - map.pixels[i].position);
      if (std::abs(off) > kOnPlane * deviations[i] + flat) continue;
      least = deviations[i];
      quietest = i;
    }
  }
  return quietest;
}

struct SharpNormal {
  int pixel;
  Eigen::Vector3f normal;
};

/// The normals of a row that another window than their own gives.
std::vector<SharpNormal> sharpen_row(const DepthMap& map, const std::vector<float>& deviations, int v, int radius) {
  std::vector<SharpNormal> sharper;
  for (int u = 0; u < map.width; ++u) {
    const int i = v * map.width + u;
    if (!map.measured(i)) continue;
    const int window = quietest_window(map, deviations, u, v, radius);
    if (window != i) sharper.push_back({i, map.pixels[window].normal});
  }
  return sharper;
}

}  // namespace

double normal_error(double noise, double pixel_size, int radius) {
  const double side = 2 * radius + 1;
  const double sum_sq_offset = side * side * radius * (radius + 1) / 3;  // of a window's pixels along one axis
  return noise / (pixel_size * std::sqrt(sum_sq_offset));
}

std::vector<float> estimate_normals(DepthMap& map, int radius, const RunControl& control) {
  Deviations deviations(map.pixels.size());
  const RayImage rays(map, radius, control.threads);
  parallel_for(map.height, control.threads, [&](int v) {
    if (!control.interrupted()) fit_row(map, rays, v, radius, deviations);
  });
  if (!control.interrupted()) map.noise = noise_of(std::move(deviations.steady));
  return std::move(deviations.all);
}

void sharpen_normals(DepthMap& map, const std::vector<float>& deviations, int radius, const RunControl& control) {
  std::vector<std::vector<SharpNormal>> rows(map.height);
  parallel_for(map.height, control.threads, [&](int v) {
    if (!control.interrupted()) rows[v] = sharpen_row(map, deviations, v, radius);
  });
  if (control.interrupted()) return;
  for (const std::vector<SharpNormal>& row : rows) {
    for (const SharpNormal& sharp : row) map.pixels[sharp.pixel].normal = sharp.normal;
  }
}

}  // namespace binpose

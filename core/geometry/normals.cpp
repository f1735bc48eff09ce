#include "core/geometry/normals.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/geometry/lane_points.h"
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
struct RayImage : MarginLayout {
  std::vector<float> x, y;  ///< tangents of the ray through the point
  std::vector<float> z, w;  ///< depth and inverse depth; 0: nothing measured

  RayImage(const DepthMap& map, int radius, int threads) : MarginLayout(map, radius) {
    for (std::vector<float>* values : {&x, &y, &z, &w}) values->assign(size, 0);
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

/// Normals of a row of pixels.
BINPOSE_VECTORISED
void fit_row(DepthMap& map, const RayImage& rays, int v, int radius, WindowPlanes& planes,
             std::vector<float>& steady_deviations) {
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
    const Lanes zero = {}, scale = good ? -1 / length : zero;
    const std::size_t to = planes.at(u, v);
    store_lanes(a * scale, &planes.normal_x[to]);
    store_lanes(b * scale, &planes.normal_y[to]);
    store_lanes(c * scale, &planes.normal_z[to]);
    store_lanes((a * x0 + b * y0 + c) * z0 * scale, &planes.offset[to]);
    const LaneInts known = good & (z0 > 0);
    store_lanes(known ? off : zero + INFINITY, &planes.deviation[to]);
    for (int lane = 0; lane < std::min(kLanes, map.width - u); ++lane) {
      const int i = v * map.width + u + lane;
      if (!map.measured(i)) continue;
      map.pixels[i].normal = planes.normal(to + lane);
      if (steady[lane] != 0) steady_deviations[i] = off[lane];
    }
  }
}

/// The noise that explains the quietest windows: edges and curvature only make others louder.
float noise_of(const std::vector<float>& deviations) {
  constexpr std::size_t kEnoughWindows = 40'000;
  std::vector<float> known;
  const std::size_t step = 1 + deviations.size() / kEnoughWindows;
  for (std::size_t i = 0; i < deviations.size(); i += step) {
    if (!std::isinf(deviations[i])) known.push_back(deviations[i]);
  }
  if (known.empty()) return 0;
  const auto quarter = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 4);
  std::nth_element(known.begin(), quarter, known.end());
  // A quarter of the windows of 9 points on a plane deviate by less than this share of the noise: sqrt(chi^2_6 / 6).
  constexpr float kQuarterOfNine = 0.76F;
  return *quarter / kQuarterOfNine;
}

struct SharpNormal {
  int pixel;
  Eigen::Vector3f normal;
};

/// The normals of a row that another window than their own gives.
BINPOSE_VECTORISED
std::vector<SharpNormal> sharpen_row(const DepthMap& map, const WindowPlanes& planes, int v) {
  const float flat = kFlat * map.pixel_size;
  std::vector<SharpNormal> sharper;
  for (int u = 0; u < map.width; u += kLanes) {
    const SurfacePoint* pixels = &map.pixels[static_cast<std::size_t>(v) * map.width + u];
    const int count = std::min(kLanes, map.width - u);
    const LanePoints p =
        SurfaceLanes([&](int i) -> const SurfacePoint& { return pixels[std::min(i, count - 1)]; }).position;
    Lanes least = load_lanes(&planes.deviation[planes.at(u, v)]);
    const LaneInts open = (p.z > 0) & (least >= flat);
    least *= kMuchQuieter;
    LanePoints normal = {};
    LaneInts found = {};
    for (int row = v - planes.radius; row <= v + planes.radius; row += planes.radius) {
      for (int column = u - planes.radius; column <= u + planes.radius; column += planes.radius) {
        const std::size_t at = planes.at(column, row);
        const Lanes deviation = load_lanes(&planes.deviation[at]);
        const LanePoints n = {load_lanes(&planes.normal_x[at]), load_lanes(&planes.normal_y[at]),
                              load_lanes(&planes.normal_z[at])};
        const Lanes off = magnitude(dot(n, p) - load_lanes(&planes.offset[at]));
        const LaneInts better = open & (deviation < least) & (off <= kOnPlane * deviation + flat);
        least = better ? deviation : least;
        normal = {better ? n.x : normal.x, better ? n.y : normal.y, better ? n.z : normal.z};
        found |= better;
      }
    }
    for_each_set(found, count, [&](int i) {
      sharper.push_back({v * map.width + u + i, {normal.x[i], normal.y[i], normal.z[i]}});
    });
  }
  return sharper;
}

}  // namespace

double normal_error(double noise, double pixel_size, int radius) {
  const double side = 2 * radius + 1;
  const double sum_sq_offset = side * side * radius * (radius + 1) / 3;  // of a window's pixels along one axis
  return noise / (pixel_size * std::sqrt(sum_sq_offset));
}

MarginLayout::MarginLayout(const DepthMap& map, int radius)
    : radius(radius),
      stride(map.width + 2 * radius + kLanes),
      size(static_cast<std::size_t>(stride) * (map.height + 2 * radius)) {}

WindowPlanes::WindowPlanes(const DepthMap& map, int radius) : MarginLayout(map, radius) {
  for (std::vector<float>* values : {&normal_x, &normal_y, &normal_z, &offset}) values->assign(size, 0);
  deviation.assign(size, INFINITY);
}

WindowPlanes estimate_normals(DepthMap& map, int radius, const RunControl& control) {
  WindowPlanes planes(map, radius);
  std::vector<float> steady_deviations(map.pixels.size(), INFINITY);
  const RayImage rays(map, radius, control.threads);
  parallel_for(map.height, control.threads, [&](int v) {
    if (!control.interrupted()) fit_row(map, rays, v, radius, planes, steady_deviations);
  });
  if (!control.interrupted()) map.noise = noise_of(steady_deviations);
  return planes;
}

void sharpen_normals(DepthMap& map, const WindowPlanes& planes, const RunControl& control) {
  std::vector<std::vector<SharpNormal>> rows(map.height);
  parallel_for(map.height, control.threads, [&](int v) {
    if (!control.interrupted()) rows[v] = sharpen_row(map, planes, v);
  });
  if (control.interrupted()) return;
  for (const std::vector<SharpNormal>& row : rows) {
    for (const SharpNormal& sharp : row) map.pixels[sharp.pixel].normal = sharp.normal;
  }
}

}  // namespace binpose

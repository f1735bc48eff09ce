#include "tests/scenes/scan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "tests/scenes/ray_scene.h"

namespace binpose::scenes {
namespace {

constexpr double kStepAtEdge = 2;  // in point spacings: a pixel that sees a wider range of depths straddles an edge
constexpr double kLostAtEdge = 0.4;
constexpr double kLostAnywhere = 0.002;

struct Measurement {
  Eigen::Vector3d point;
  std::optional<std::uint32_t> object;  ///< none for a flying pixel
};

/// Chance that light at this incidence is still decoded: 1 up to grazing_from, 0 from grazing_to.
double chance_at(double cosine, const Scanner& scanner) {
  const double degrees = std::acos(std::clamp(cosine, 0.0, 1.0)) * 180 / std::numbers::pi;
  return std::clamp((scanner.grazing_to - degrees) / (scanner.grazing_to - scanner.grazing_from), 0.0, 1.0);
}

/// One scanner before one scene.
class Measuring {
 public:
  Measuring(const RayScene& scene, const Scanner& scanner, const CameraIntrinsics& camera)
      : scene_(scene), scanner_(scanner), camera_(camera) {}

  /// What pixel (u, v) yields. Draws the same numbers whatever it sees.
  std::optional<Measurement> at(int u, int v, Random random) const {
    const double lost = random.uniform(0, 1), edge = random.uniform(0, 1), mix = random.uniform(0, 1);
    const double grazing = random.uniform(0, 1), noise = random.normal() * scanner_.noise;
    if (lost < kLostAnywhere) return std::nullopt;

    const Eigen::Vector3d ray = direction(u, v);
    const std::optional<RayHit> hit = scene_.cast(Eigen::Vector3d::Zero(), ray);
    if (!hit) return std::nullopt;
    const Eigen::Vector3d point = hit->distance * ray;
    const Eigen::Vector3d to_projector = (scanner_.projector - point).normalized();
    const double seen = std::abs(hit->normal.dot(ray)), lit = std::abs(hit->normal.dot(to_projector));
    if (grazing >= chance_at(std::min(seen, lit), scanner_)) return std::nullopt;
    if (scene_.blocked(point + 1e-5 * to_projector, scanner_.projector)) return std::nullopt;

    if (const auto [near, far] = depth_range(u, v); far - near > kStepAtEdge * scanner_.point_spacing / seen) {
      if (edge < kLostAtEdge) return std::nullopt;
      if (edge < kLostAtEdge + scanner_.flying_share) return Measurement{(near + mix * (far - near)) * ray, {}};
    }
    return Measurement{(hit->distance + noise) * ray, hit->object};
  }

 private:
  Eigen::Vector3d direction(double u, double v) const {
    return Eigen::Vector3d((u - camera_.cx) / camera_.fx, (v - camera_.cy) / camera_.fy, 1).normalized();
  }

  /// Nearest and farthest surface within the pixel's square.
  std::pair<double, double> depth_range(double u, double v) const {
    double near = std::numeric_limits<double>::infinity(), far = 0;
    for (const auto& [du, dv] :
         {std::pair(-0.5, -0.5), std::pair(0.5, -0.5), std::pair(-0.5, 0.5), std::pair(0.5, 0.5)}) {
      const std::optional<RayHit> hit = scene_.cast(Eigen::Vector3d::Zero(), direction(u + du, v + dv));
      if (hit) near = std::min(near, hit->distance), far = std::max(far, hit->distance);
    }
    return {near, far};
  }

  const RayScene& scene_;
  const Scanner& scanner_;
  const CameraIntrinsics& camera_;
};

/// The bin before the scanner, tilted by a few degrees: its z axis towards the camera.
Pose place_bin(const Scanner& scanner, Random random) {
  constexpr double kDegree = std::numbers::pi / 180;
  const Eigen::AngleAxisd upside(std::numbers::pi, Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd tilt_x(random.uniform(-4, 4) * kDegree, Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd tilt_y(random.uniform(-4, 4) * kDegree, Eigen::Vector3d::UnitY());
  const Eigen::AngleAxisd turn(random.uniform(-3, 3) * kDegree, Eigen::Vector3d::UnitZ());
  return Eigen::Translation3d(0, 0, scanner.distance) * Eigen::Quaterniond(tilt_x * tilt_y * turn * upside);
}

/// An empty cloud of the size at which the whole bin is in the picture.
PointCloud frame(const Mesh& bin, const Pose& T_scene_bin, const Scanner& scanner) {
  const double f = scanner.distance / scanner.point_spacing;
  Eigen::AlignedBox2d box;
  for (const auto& vertex : bin.vertices) {
    const Eigen::Vector3d p = T_scene_bin * vertex.cast<double>();
    box.extend(f * p.head<2>() / p.z());
  }
  constexpr double kBorder = 2;  // pixels
  const Eigen::Vector2d principal = Eigen::Vector2d::Constant(kBorder) - box.min();
  PointCloud cloud;
  cloud.width = static_cast<std::uint32_t>(box.sizes().x() + 2 * kBorder);
  cloud.height = static_cast<std::uint32_t>(box.sizes().y() + 2 * kBorder);
  cloud.intrinsics = CameraIntrinsics{f, f, principal.x(), principal.y()};
  cloud.points.assign(std::size_t{cloud.width} * cloud.height,
                      Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  return cloud;
}

/// A rectangle of pixels, the upper bounds not included.
struct Region {
  std::uint32_t first_u = 0, first_v = 0, end_u = 0, end_v = 0;
};

Region whole(const PointCloud& cloud) { return {0, 0, cloud.width, cloud.height}; }

/// The pixels that a posed part may show in.
Region region_of(const Mesh& part, const Pose& T_scene_model, const PointCloud& cloud) {
  const CameraIntrinsics& camera = *cloud.intrinsics;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector3f& vertex : part.vertices) {
    const Eigen::Vector3d p = T_scene_model * vertex.cast<double>();
    box.extend(Eigen::Vector2d(camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy));
  }
  const auto pixel = [](double at, std::uint32_t end) {
    return static_cast<std::uint32_t>(std::clamp(at, 0.0, static_cast<double>(end)));
  };
  return {pixel(box.min().x() - 1, cloud.width), pixel(box.min().y() - 1, cloud.height),
          pixel(box.max().x() + 2, cloud.width), pixel(box.max().y() + 2, cloud.height)};
}

/// Measures the pixels of a region; tells `found` of each that yields something.
template <typename Found>
void measure_all(const RayScene& scene, const Scanner& scanner, const Random& random, const PointCloud& frame,
                 const Region& region, Found found) {
  const Measuring measure(scene, scanner, *frame.intrinsics);
  for (std::uint32_t v = region.first_v; v < region.end_v; ++v) {
    for (std::uint32_t u = region.first_u; u < region.end_u; ++u) {
      const std::uint32_t pixel = v * frame.width + u;
      const auto measurement = measure.at(static_cast<int>(u), static_cast<int>(v), random.fork(pixel));
      if (measurement) found(pixel, *measurement);
    }
  }
}

}  // namespace

Scan scan_bin(const Mesh& part, const std::vector<Pose>& T_bin_models, const Bin& bin, const Scanner& scanner,
              Random random) {
  Scan scan;
  scan.T_scene_bin = place_bin(scanner, random.fork(0));
  const Mesh box = bin_mesh(bin);
  scan.cloud = frame(box, scan.T_scene_bin, scanner);
  const Random noise = random.fork(1);

  RayScene pile;  // object 0 is the bin, the parts follow
  pile.add(box, scan.T_scene_bin);
  for (const Pose& T_bin_model : T_bin_models) {
    scan.instances.push_back({scan.T_scene_bin * T_bin_model});
    pile.add(part, scan.instances.back().T_scene_model);
  }
  pile.build();
  measure_all(pile, scanner, noise, scan.cloud, whole(scan.cloud), [&](std::uint32_t pixel, const Measurement& found) {
    scan.cloud.points[pixel] = found.point.cast<float>();
    if (found.object && *found.object > 0) ++scan.instances[*found.object - 1].visible_points;
  });

  for (Instance& instance : scan.instances) {
    RayScene alone;
    alone.add(box, scan.T_scene_bin);
    alone.add(part, instance.T_scene_model);
    alone.build();
    const Region region = region_of(part, instance.T_scene_model, scan.cloud);
    measure_all(alone, scanner, noise, scan.cloud, region,
                [&](std::uint32_t, const Measurement& found) { instance.alone_points += found.object == 1U; });
  }
  return scan;
}

}  // namespace binpose::scenes

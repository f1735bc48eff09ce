#include "core/detect/support_plane.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <optional>

namespace binpose {
namespace {

constexpr int kSeeds = 80;
constexpr int kProbes = 1500;  // pixels that a candidate plane is judged on
constexpr double kLeastShare = 0.1;
constexpr double kMostBehind = 0.01;
constexpr float kLeastExtent = 2;  // diameters, both ways
constexpr float kRelativeTolerance = 0.012F;
constexpr float kSameNormalCosine = 0.94F;  // 20 degrees

struct ViewPlane {
  Eigen::Vector3f normal;  // towards the sensor
  float offset;            // normal . point
};

std::vector<int> pixels_with_normal(const DepthMap& map) {
  std::vector<int> pixels;
  for (int i = 0; i < static_cast<int>(map.pixels.size()); ++i) {
    if (map.has_normal(i)) pixels.push_back(i);
  }
  return pixels;
}

/// Every n-th of some pixels, so that about `count` are taken.
std::vector<SurfacePoint> evenly_taken(const DepthMap& map, const std::vector<int>& pixels, int count) {
  std::vector<SurfacePoint> taken;
  const int available = static_cast<int>(pixels.size());
  const int most = std::min(count, available);
  taken.reserve(most);
  for (int i = 0; i < most; ++i) taken.push_back(map.pixels[pixels[static_cast<std::int64_t>(i) * available / most]]);
  return taken;
}

bool on_plane(const SurfacePoint& point, const ViewPlane& plane, float tolerance) {
  return std::abs(plane.normal.dot(point.position) - plane.offset) <= tolerance &&
         plane.normal.dot(point.normal) >= kSameNormalCosine;
}

/// Least-squares plane through the probes that lie on a plane.
ViewPlane refit(const std::vector<SurfacePoint>& probes, const ViewPlane& plane, float tolerance, float& extent) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  int count = 0;
  for (const SurfacePoint& probe : probes) {
    if (!on_plane(probe, plane, tolerance)) continue;
    const Eigen::Vector3d p = probe.position.cast<double>();
    sum += p;
    squares += p * p.transpose();
    ++count;
  }
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count - mean * mean.transpose());
  // A strip of length w has a standard deviation of w / sqrt(12) along it.
  extent = static_cast<float>(std::sqrt(12 * std::max(0.0, axes.eigenvalues()[1])));
  Eigen::Vector3f normal = axes.eigenvectors().col(0).cast<float>();
  if (normal.dot(plane.normal) < 0) normal = -normal;
  return {normal, normal.dot(mean.cast<float>())};
}

/// The seed plane that holds most probes among those with next to nothing behind them.
std::optional<ViewPlane> find_plane(const DepthMap& map, float diameter, float tolerance) {
  const std::vector<int> pixels = pixels_with_normal(map);
  const std::vector<SurfacePoint> probes = evenly_taken(map, pixels, kProbes);
  const double most_behind = kMostBehind * static_cast<double>(probes.size());
  std::optional<ViewPlane> best;
  auto most = static_cast<int>(kLeastShare * static_cast<double>(probes.size()));
  for (const SurfacePoint& seed : evenly_taken(map, pixels, kSeeds)) {
    const ViewPlane plane{seed.normal, seed.normal.dot(seed.position)};
    int on = 0, behind = 0;
    for (const SurfacePoint& probe : probes) {
      on += on_plane(probe, plane, 2 * tolerance);
      behind += plane.normal.dot(probe.position) < plane.offset - 4 * tolerance;
      if (behind > most_behind) break;
    }
    if (on <= most || behind > most_behind) continue;
    float extent = 0;
    const ViewPlane fitted = refit(probes, plane, 2 * tolerance, extent);
    if (extent < kLeastExtent * diameter) continue;
    most = on;
    best = fitted;
  }
  return best;
}

}  // namespace

float plane_tolerance(const DepthMap& map, float diameter) { return kRelativeTolerance * diameter + 2 * map.noise; }

bool mark_support_plane(DepthMap& map, float diameter) {
  const float tolerance = plane_tolerance(map, diameter);
  const std::optional<ViewPlane> plane = find_plane(map, diameter, tolerance);
  if (!plane) return false;
  for (int i = 0; i < static_cast<int>(map.pixels.size()); ++i) {
    map.background[i] = map.has_normal(i) && on_plane(map.pixels[i], *plane, tolerance) ? 1 : 0;
  }
  return true;
}

}  // namespace binpose

#include "core/train/visibility.h"

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "core/geometry/normals.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// Votes for one side over votes for the other, from which on the sides are told apart.
constexpr double kClearMajority = 1.25;

/// Positions coordinate by coordinate, so that all of them are projected by vector instructions.
struct Positions {
  Eigen::ArrayXf x, y, z;

  explicit Positions(std::span<const SurfacePoint> points)
      : x(static_cast<Eigen::Index>(points.size())), y(x.size()), z(x.size()) {
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const Eigen::Vector3f& p = points[static_cast<std::size_t>(i)].position;
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
  }
};

/// How far along a direction; for one point and for many to the same last bit.
float along(const Eigen::Vector3f& direction, const Eigen::Vector3f& p) {
  return direction.x() * p.x() + direction.y() * p.y() + direction.z() * p.z();
}
Eigen::ArrayXf along(const Eigen::Vector3f& direction, const Positions& p) {
  return direction.x() * p.x + direction.y() * p.y + direction.z() * p.z;
}

/// The nearest surface in each cell of a plane across the view. Depths count towards the viewer.
class ProjectionPlane {
 public:
  ProjectionPlane(const Positions& dense, const Eigen::Vector3f& viewpoint, float cell)
      : towards_viewer_(viewpoint), right_(viewpoint.unitOrthogonal()), up_(viewpoint.cross(right_)), cell_(cell) {
    const Eigen::ArrayXf right = along(right_, dense), up = along(up_, dense), depth = along(towards_viewer_, dense);
    if (depth.size() == 0) return;
    origin_ = {right.minCoeff(), up.minCoeff()};
    width_ = static_cast<int>((right.maxCoeff() - origin_[0]) / cell) + 1;
    const int height = static_cast<int>((up.maxCoeff() - origin_[1]) / cell) + 1;
    nearest_.assign(static_cast<std::size_t>(width_) * height, -INFINITY);
    for (Eigen::Index i = 0; i < depth.size(); ++i) {
      float& nearest = nearest_[index(Eigen::Array2f(right[i], up[i]))];
      nearest = std::max(nearest, depth[i]);
    }
  }

  /// Whether nothing lies in front of the point, whichever way its normal looks.
  bool reaches(const SurfacePoint& point) const {
    const float cosine = std::abs(towards_viewer_.dot(point.normal));
    const float slope = std::sqrt(std::max(0.0F, 1 - cosine * cosine)) / std::max(cosine, kGrazingCosine);
    return along(towards_viewer_, point.position) >= nearest_[index(point.position)] - cell_ * (0.3F + 1.2F * slope);
  }

  /// Whether the point is the one that its cell shows.
  bool is_nearest(const SurfacePoint& point) const {
    return along(towards_viewer_, point.position) >= nearest_[index(point.position)];
  }

  float cosine(const SurfacePoint& point) const { return towards_viewer_.dot(point.normal); }

 private:
  std::size_t index(const Eigen::Vector3f& p) const { return index(Eigen::Array2f(along(right_, p), along(up_, p))); }
  /// Points lie inside the plane's extent, as all are points of the surface that it was made from.
  std::size_t index(const Eigen::Array2f& place) const {
    const Eigen::Array2i c = ((place - origin_) / cell_).cast<int>();
    const std::size_t i = static_cast<std::size_t>(std::max(0, c[1])) * width_ + std::clamp(c[0], 0, width_ - 1);
    return std::min(i, nearest_.size() - 1);
  }

  Eigen::Vector3f towards_viewer_, right_, up_;
  Eigen::Array2f origin_;
  float cell_;
  int width_ = 0;
  std::vector<float> nearest_;
};

}  // namespace

std::vector<ViewMask> visibility(std::span<const SurfacePoint> dense, std::span<const SurfacePoint> points,
                                 std::span<const Eigen::Vector3f> viewpoints, double cell, const RunControl& control) {
  const int words = static_cast<int>((viewpoints.size() + 63) / 64);
  std::vector<ViewMask> masks(points.size(), ViewMask(words, 0));
  const Positions positions(dense);
  // A word of 64 viewpoints is one thread's, so that no two write to the same place.
  parallel_for(words, control.threads, [&](int word) {
    const int last = std::min(static_cast<int>(viewpoints.size()), 64 * (word + 1));
    for (int k = 64 * word; k < last && !control.interrupted(); ++k) {
      const ProjectionPlane plane(positions, viewpoints[k], static_cast<float>(cell));
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (plane.cosine(points[i]) >= kGrazingCosine && plane.reaches(points[i])) {
          masks[i][word] |= std::uint64_t{1} << (k % 64);
        }
      }
    }
  });
  return masks;
}

double observability(const ViewMask& point, int view_count) {
  int seen = 0;
  for (const std::uint64_t word : point) seen += std::popcount(word);
  return static_cast<double>(seen) / view_count;
}

double observability(const ViewMask& p, const ViewMask& q1, const ViewMask& q2, int view_count) {
  int seen = 0;
  for (std::size_t w = 0; w < p.size(); ++w) seen += std::popcount(p[w] & q1[w] & q2[w]);
  return static_cast<double>(seen) / view_count;
}

std::vector<bool> seen_from_behind(std::span<const SurfacePoint> dense, std::span<const std::uint32_t> shell_of,
                                   std::span<const Eigen::Vector3f> viewpoints, double cell,
                                   const RunControl& control) {
  struct Votes {
    int front = 0, behind = 0;
    bool clear() const { return std::max(front, behind) > kClearMajority * std::min(front, behind); }
  };
  std::unordered_map<std::uint32_t, Votes> by_shell;
  Votes all;
  const Positions positions(dense);
  for (const Eigen::Vector3f& viewpoint : viewpoints) {
    if (control.interrupted()) break;
    const ProjectionPlane plane(positions, viewpoint, static_cast<float>(cell));
    for (std::size_t i = 0; i < dense.size(); ++i) {
      const float cosine = plane.cosine(dense[i]);
      // Where the surface is seen edge on, either side of a thin wall may win.
      if (std::abs(cosine) < 0.5F || !plane.is_nearest(dense[i])) continue;
      Votes& shell = by_shell[shell_of[i]];
      ++(cosine > 0 ? shell.front : shell.behind);
      ++(cosine > 0 ? all.front : all.behind);
    }
  }
  std::vector<bool> behind(dense.size());
  for (std::size_t i = 0; i < dense.size(); ++i) {
    const auto found = by_shell.find(shell_of[i]);
    const Votes& votes = found != by_shell.end() && found->second.clear() ? found->second : all;
    behind[i] = votes.clear() && votes.behind > votes.front;
  }
  return behind;
}

}  // namespace binpose

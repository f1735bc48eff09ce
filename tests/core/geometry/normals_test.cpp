#include "core/geometry/normals.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/params.h"
#include "tests/support/ray_cast.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

constexpr double kMapPixel = 0.002;

/// The bodies from above, with normals of a 3 x 3 window.
DepthMap map_of(std::span<const testing::PlacedMesh> bodies, std::optional<double> floor_depth, double noise = 0) {
  testing::PinholeSensor sensor;
  sensor.width = 150;
  sensor.height = 112;
  sensor.focal = 1.25 * 0.5 / kMapPixel;  // more than a point per pixel
  sensor.floor_depth = floor_depth;
  sensor.noise = noise;
  DepthMap map = depth_map(*sensor_view(testing::render(bodies, sensor)), kMapPixel);
  estimate_normals(map, 1);
  return map;
}

testing::PlacedMesh placed(Mesh mesh, const Eigen::Vector3d& at, double tilt_degrees = 0) {
  Pose T_scene_mesh(Eigen::AngleAxisd(tilt_degrees * kDegree, Eigen::Vector3d(1, 2, 0).normalized()));
  T_scene_mesh.pretranslate(at);
  return {std::move(mesh), T_scene_mesh};
}

double angle_degrees(const Vector3f& a, const Vector3f& b) {
  return std::acos(std::clamp(static_cast<double>(a.dot(b)), -1.0, 1.0)) / kDegree;
}

TEST(Normals, OfATiltedPlaneAreExact) {
  for (const double tilt : {0.0, 20.0, 45.0, 60.0}) {
    const testing::PlacedMesh slab = placed(testing::box({2, 2, 0.02F}), {0, 0, 0.5}, tilt);
    const DepthMap map = map_of({&slab, 1}, std::nullopt);
    const Vector3f expected = map.T_scene_view.linear().transpose().cast<float>() *
                              slab.T_scene_mesh.linear().cast<float>() * Vector3f(0, 0, -1);
    int count = 0;
    for (std::size_t i = 0; i < map.pixels.size(); ++i) {
      if (!map.has_normal(static_cast<int>(i))) continue;
      ++count;
      ASSERT_LT(angle_degrees(map.pixels[i].normal, expected), 0.3) << "tilt " << tilt;
    }
    EXPECT_GT(count, 0.6 * 120 * 90) << "tilt " << tilt;
  }
}

TEST(Normals, OfASpherePointFromItsCentre) {
  const testing::PlacedMesh ball = placed(testing::sphere(0.06F), {0, 0, 0.5});
  const DepthMap map = map_of({&ball, 1}, std::nullopt);
  const Vector3f centre = (map.T_scene_view.inverse() * Eigen::Vector3d(0, 0, 0.5)).cast<float>();
  int count = 0;
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    if (!map.has_normal(static_cast<int>(i))) continue;
    const Vector3f radial = (map.pixels[i].position - centre).normalized();
    // Facets are 7.5 degrees wide; near the side, where the window is cut off, the fit leans inwards.
    if (radial.z() > -0.5F) continue;
    ++count;
    EXPECT_LT(angle_degrees(map.pixels[i].normal, radial), 6);
  }
  EXPECT_GT(count, 1000);
}

/// Normal of the plane of least squares through the window's points, if they are many and nearby.
Vector3f pca_normal(const DepthMap& map, int u, int v) {
  std::vector<Vector3f> window;
  const Vector3f centre = map.pixels[v * map.width + u].position;
  for (int row = v - 1; row <= v + 1; ++row) {
    for (int column = u - 1; column <= u + 1; ++column) {
      const Vector3f& p = map.pixels[row * map.width + column].position;
      if (p.z() > 0 && std::abs(p.z() - centre.z()) < 2 * static_cast<float>(kMapPixel)) window.push_back(p);
    }
  }
  if (window.size() < 9) return Vector3f::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Vector3f& p : window) mean += p.cast<double>() / 9;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Vector3f& p : window) {
    covariance += (p.cast<double>() - mean) * (p.cast<double>() - mean).transpose();
  }
  const Vector3f normal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0).cast<float>();
  return normal.dot(centre) > 0 ? Vector3f(-normal) : normal;
}

TEST(Normals, AgreeWithPrincipalAxesOnNoisySurfaces) {
  const testing::PlacedMesh bodies[] = {placed(testing::sphere(0.05F), {0, 0, 0.5}),
                                        placed(testing::box({0.06F, 0.08F, 0.04F}), {0.07, 0.01, 0.5}, 25)};
  const DepthMap map = map_of(bodies, 0.55, 5e-5);
  int compared = 0, far = 0;
  double sum = 0;
  for (int v = 1; v + 1 < map.height; ++v) {
    for (int u = 1; u + 1 < map.width; ++u) {
      const Vector3f expected = pca_normal(map, u, v);
      const Vector3f& normal = map.pixels[v * map.width + u].normal;
      if (expected.isZero() || expected.z() > -0.7F || normal.isZero()) continue;
      ++compared;
      sum += angle_degrees(normal, expected);
      far += static_cast<int>(angle_degrees(normal, expected) > 4);
    }
  }
  EXPECT_LT(sum / compared, 0.5);
  EXPECT_LT(far, 0.01 * compared) << "at the edges, where the two limits of a window differ";
  EXPECT_GT(compared, 4000);
}

TEST(Normals, DoNotMixTheTwoSidesOfADepthStep) {
  const testing::PlacedMesh block = placed(testing::box({0.08F, 0.08F, 0.05F}), {0, 0, 0.47});
  const DepthMap map = map_of({&block, 1}, 0.495);
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    if (!map.has_normal(static_cast<int>(i))) continue;
    const Vector3f normal = map.T_scene_view.linear().cast<float>() * map.pixels[i].normal;
    EXPECT_LT(angle_degrees(normal, {0, 0, -1}), 0.5);
  }
}

TEST(Normals, OfGrazingSurfacesAndLonelyPointsDoNotExist) {
  const testing::PlacedMesh steep = placed(testing::box({2, 2, 0.001F}), {0, 0, 0.5}, 84);
  const DepthMap map = map_of({&steep, 1}, std::nullopt);
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    if (map.has_normal(static_cast<int>(i))) {
      EXPECT_GE(-map.pixels[i].normal.dot(map.pixels[i].position.normalized()), std::cos(80.1 * kDegree));
    }
  }
  PointCloud lonely;
  lonely.points = {{0, 0, 0.5F}, {0.1F, 0, 0.5F}, {0, 0.1F, 0.5F}};
  lonely.width = 3;
  lonely.height = 1;
  DepthMap sparse = depth_map(*sensor_view(lonely), kMapPixel);
  estimate_normals(sparse, 1);
  for (const SurfacePoint& pixel : sparse.pixels) EXPECT_TRUE(pixel.normal.isZero());
}

/// Pixels of a convex roof, both sides towards the sensor, whose normal is more than 8 degrees off both sides'.
int count_off_both_sides(const DepthMap& map, const testing::PlacedMesh& roof) {
  const Eigen::Matrix3f R = (map.T_scene_view.linear().transpose() * roof.T_scene_mesh.linear()).cast<float>();
  int off = 0;
  for (const SurfacePoint& pixel : map.pixels) {
    if (pixel.normal.isZero()) continue;
    const double least = std::min(angle_degrees(pixel.normal, R * -Vector3f::UnitZ()),
                                  angle_degrees(pixel.normal, R * Vector3f::UnitX()));
    off += static_cast<int>(least > 8);
  }
  return off;
}

TEST(Normals, OnceSharpenedBelongToOneSideOfAnEdge) {
  testing::PlacedMesh roof = placed(testing::box({0.1F, 0.1F, 0.1F}), {0, 0, 0});
  roof.T_scene_mesh = Eigen::Translation3d(0, 0, 0.5) * Eigen::AngleAxisd(45 * kDegree, Eigen::Vector3d::UnitY());
  for (const double noise : {0.0, 5e-5}) {
    for (const int radius : {1, 2}) {
      DepthMap map = map_of({&roof, 1}, std::nullopt, noise);
      const WindowPlanes planes = estimate_normals(map, radius);
      const int before = count_off_both_sides(map, roof);
      sharpen_normals(map, planes);
      EXPECT_GT(before, 80) << "radius " << radius;
      EXPECT_LT(count_off_both_sides(map, roof), before / 5) << "radius " << radius << ", noise " << noise;
    }
  }
}

/// The slow twin of sharpen_normals(): the normal of the window that describes a pixel best, one after the other.
Vector3f sharpened(const DepthMap& map, const WindowPlanes& planes, int u, int v) {
  const std::size_t own = planes.at(u, v);
  const SurfacePoint& pixel = map.pixels[static_cast<std::size_t>(v) * map.width + u];
  const float flat = 0.02F * map.pixel_size;
  Vector3f normal = pixel.normal;
  float least = 0.7F * planes.deviation[own];
  if (planes.deviation[own] < flat || !(pixel.position.z() > 0)) return normal;
  for (int row = -1; row <= 1; ++row) {
    for (int column = -1; column <= 1; ++column) {
      const std::size_t i = planes.at(u + column * planes.radius, v + row * planes.radius);
      const float off = std::abs(planes.normal(i).dot(pixel.position) - planes.offset[i]);
      if (!(planes.deviation[i] < least) || off > 2 * planes.deviation[i] + flat) continue;
      least = planes.deviation[i];
      normal = planes.normal(i);
    }
  }
  return normal;
}

TEST(Normals, AreSharpenedEightAtATimeAsALoopDoesOneByOne) {
  const testing::PlacedMesh block = placed(testing::box({0.08F, 0.08F, 0.05F}), {0, 0, 0.45}, 20);
  for (const int radius : {1, 2}) {
    DepthMap map = map_of({&block, 1}, 0.5, 1e-4);
    const WindowPlanes planes = estimate_normals(map, radius);
    const DepthMap before = map;
    sharpen_normals(map, planes);
    int changed = 0;
    for (int v = 0; v < map.height; ++v) {
      for (int u = 0; u < map.width; ++u) {
        const int i = v * map.width + u;
        ASSERT_LT((map.pixels[i].normal - sharpened(before, planes, u, v)).norm(), 1e-5F) << u << ", " << v;
        changed += map.pixels[i].normal != before.pixels[i].normal ? 1 : 0;
      }
    }
    EXPECT_GT(changed, 500);
  }
}

TEST(Normals, OnceSharpenedStayOnACurvedSurface) {
  const testing::PlacedMesh ball = placed(testing::sphere(0.06F), {0, 0, 0.5});
  DepthMap map = map_of({&ball, 1}, std::nullopt);
  sharpen_normals(map, estimate_normals(map, 1));
  const Vector3f centre = (map.T_scene_view.inverse() * Eigen::Vector3d(0, 0, 0.5)).cast<float>();
  for (const SurfacePoint& pixel : map.pixels) {
    const Vector3f radial = (pixel.position - centre).normalized();
    if (pixel.normal.isZero() || radial.z() > -0.5F) continue;
    EXPECT_LT(angle_degrees(pixel.normal, radial), 8);
  }
}

TEST(Normals, TellTheNoiseOfTheSensor) {
  const testing::PlacedMesh block = placed(testing::box({0.08F, 0.08F, 0.05F}), {0, 0, 0.45}, 20);
  EXPECT_LT(map_of({&block, 1}, 0.5).noise, 1e-5F);
  // Of several points in a pixel the nearest is kept, which quietens a little.
  for (const double noise : {1e-4, 4e-4}) EXPECT_NEAR(map_of({&block, 1}, 0.5, noise).noise, noise, 0.25 * noise);
}

TEST(Normals, ErrFromAWindowAsLeastSquaresOverItsOffsets) {
  for (const int radius : {1, 2, 3}) {
    double sum_sq = 0;
    for (int v = -radius; v <= radius; ++v) {
      for (int u = -radius; u <= radius; ++u) sum_sq += u * u;
    }
    EXPECT_NEAR(normal_error(0.0001, 0.001, radius), 0.1 / std::sqrt(sum_sq), 1e-12);
  }
}

TEST(Normals, AreTheSameOnAnyNumberOfThreads) {
  const testing::PlacedMesh ball = placed(testing::sphere(0.06F), {0, 0, 0.5});
  DepthMap one = map_of({&ball, 1}, 0.55, 1e-4);
  sharpen_normals(one, estimate_normals(one, 1));
  for (const int threads : {2, 4}) {
    DepthMap many = one;
    sharpen_normals(many, estimate_normals(many, 1, {.threads = threads}), {.threads = threads});
    for (std::size_t i = 0; i < one.pixels.size(); ++i) ASSERT_EQ(many.pixels[i].normal, one.pixels[i].normal) << i;
  }
}

}  // namespace
}  // namespace binpose

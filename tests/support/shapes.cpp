#include "tests/support/shapes.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace binpose::testing {

Mesh box(const Eigen::Vector3f& size) {
  const float x = size.x() / 2, y = size.y() / 2;
  const Eigen::Vector2f outline[] = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  return extrude(outline, size.z());
}

Mesh extrude(std::span<const Eigen::Vector2f> outline, float height) {
  Mesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const float z : {-height / 2, height / 2}) {
    for (const Eigen::Vector2f& corner : outline) mesh.vertices.emplace_back(corner.x(), corner.y(), z);
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
  }
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({n, n + i, n + i + 1});
  }
  return mesh;
}

Mesh revolve(std::span<const Eigen::Vector2f> profile, int segments) {
  Mesh mesh;
  const auto n = static_cast<std::uint32_t>(segments);
  for (const Eigen::Vector2f& point : profile) {
    for (int i = 0; i < segments; ++i) {
      const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(segments);
      mesh.vertices.emplace_back(point.x() * std::cos(angle), point.x() * std::sin(angle), point.y());
    }
  }
  for (std::uint32_t ring = 0; ring + 1 < profile.size(); ++ring) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = ring * n + i, b = ring * n + (i + 1) % n;
      if (profile[ring].x() > 0) mesh.triangles.push_back({a, b, b + n});
      if (profile[ring + 1].x() > 0) mesh.triangles.push_back({a, b + n, a + n});
    }
  }
  return mesh;
}

Mesh l_block() {
  // From the inner corner all others can be seen.
  const Eigen::Vector2f outline[] = {{0.025F, 0.025F}, {0.025F, 0.08F}, {0, 0.08F},
                                     {0, 0},           {0.05F, 0},      {0.05F, 0.025F}};
  return extrude(outline, 0.025F);
}

Mesh hexagon() {
  std::vector<Eigen::Vector2f> outline;
  for (int i = 0; i < 6; ++i) {
    const float angle = std::numbers::pi_v<float> / 3 * static_cast<float>(i);
    outline.emplace_back(0.024F * std::cos(angle), 0.024F * std::sin(angle));
  }
  return extrude(outline, 0.012F);
}

Mesh marked_hexagon() { return joined(hexagon(), shifted(box({0.01F, 0.01F, 0.004F}), {0.012F, 0, 0.008F})); }

Mesh pinned_disc() {
  const Eigen::Vector2f profile[] = {{0, -0.005F}, {0.03F, -0.005F}, {0.03F, 0.005F}, {0, 0.005F}};
  return joined(revolve(profile, 96), shifted(box({0.01F, 0.008F, 0.006F}), {0.02F, 0, 0.008F}));
}

Mesh stepped_shaft() {
  const Eigen::Vector2f profile[] = {{0, -0.045F},      {0.016F, -0.045F}, {0.016F, -0.005F},
                                     {0.009F, -0.005F}, {0.009F, 0.045F},  {0, 0.045F}};
  return revolve(profile, 32);
}

Mesh sphere(float radius) {
  std::vector<Eigen::Vector2f> profile;
  constexpr int kRings = 24;
  for (int i = 0; i <= kRings; ++i) {
    const float angle = std::numbers::pi_v<float> * static_cast<float>(i) / kRings;
    const bool pole = i == 0 || i == kRings;
    profile.emplace_back(pole ? 0 : radius * std::sin(angle), -radius * std::cos(angle));
  }
  return revolve(profile, 48);
}

Mesh joined(Mesh first, const Mesh& second) {
  const auto base = static_cast<std::uint32_t>(first.vertices.size());
  first.vertices.insert(first.vertices.end(), second.vertices.begin(), second.vertices.end());
  for (const auto& t : second.triangles) first.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  return first;
}

Mesh shifted(Mesh mesh, const Eigen::Vector3f& offset) {
  for (Eigen::Vector3f& vertex : mesh.vertices) vertex += offset;
  return mesh;
}

}  // namespace binpose::testing

#include "core/detect/ownership.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace binpose {
namespace {

constexpr float kInFront = 0.02F;  // diameters
constexpr double kTrace = 0.02;    // of the visible surface

}  // namespace

std::vector<int> explained_pixels(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                                  float tolerance) {
  const std::vector<std::uint16_t>& visible = visible_points(model, T_view_model);
  std::vector<int> pixels(9 * visible.size());
  int* end = pixels.data();
  for (const std::uint16_t point : visible) {
    const Eigen::Vector3f p = T_view_model * model.surface[point].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0) continue;
    const Eigen::Vector3f normal = T_view_model.linear() * model.surface[point].normal;
    const int u = pixel % map.width, v = pixel / map.width;
    const int first = std::max(0, u - 1), last = std::min(map.width - 1, u + 1);
    for (int row = std::max(0, v - 1); row <= std::min(map.height - 1, v + 1); ++row) {
      for (int i = row * map.width + first; i <= row * map.width + last; ++i) {
        const float distance = normal.dot(map.pixels[i].position - p);
        *end = i;
        end += static_cast<int>(map.measured(i)) & static_cast<int>(std::abs(distance) <= tolerance);
      }
    }
  }
  pixels.resize(end - pixels.data());
  return pixels;
}

std::vector<int> find_occluders(const DepthMap& map, const Model& model, const Candidate& candidate, int index,
                                const std::vector<int>& owner) {
  std::map<int, int> hidden_by;
  const std::vector<std::uint16_t>& visible = visible_points(model, candidate.T_view_model);
  for (const std::uint16_t i : visible) {
    const Eigen::Vector3f p = candidate.T_view_model * model.surface[i].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0 || owner[pixel] == kNobody || owner[pixel] == index) continue;
    const bool hidden = map.pixels[pixel].position.z() < p.z() - kInFront * static_cast<float>(model.diameter);
    if (hidden) ++hidden_by[owner[pixel]];
  }
  std::vector<int> occluders;
  for (const auto& [other, count] : hidden_by) {
    if (count > kTrace * static_cast<double>(visible.size())) occluders.push_back(other);
  }
  return occluders;
}

Eigen::AlignedBox2i image_box(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model) {
  constexpr int kMargin = 2;  // the pixels around a point that are marked, and what rounding takes
  const Eigen::AlignedBox2i image(Eigen::Vector2i::Zero(), Eigen::Vector2i(map.width - 1, map.height - 1));
  const Eigen::AlignedBox3f box(model.box_min.cast<float>(), model.box_max.cast<float>());
  Eigen::AlignedBox2f seen;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3f p = T_view_model * box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(corner));
    if (!(p.z() > 0)) return image;
    seen.extend(Eigen::Vector2f(map.focal * p.x() / p.z() + map.cx, map.focal * p.y() / p.z() + map.cy));
  }
  const Eigen::AlignedBox2f inside = seen.intersection(image.cast<float>());
  if (inside.isEmpty()) return {};
  return {inside.min().cast<int>().array() - kMargin, inside.max().cast<int>().array() + 1 + kMargin};
}

}  // namespace binpose

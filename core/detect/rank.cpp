#include "core/detect/rank.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace binpose {
namespace {

constexpr int kNobody = -1;
constexpr float kInFront = 0.02F;  // diameters
constexpr double kTrace = 0.02;    // of the visible surface

/// Marks the pixels that a pose explains: those around each visible model point that measure the same surface.
void own_pixels(const DepthMap& map, const Model& model, const Candidate& candidate, float tolerance, int index,
                std::vector<int>& owner) {
  for (const std::uint16_t point : visible_points(model, candidate.T_view_model)) {
    const Eigen::Vector3f p = candidate.T_view_model * model.surface[point].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0) continue;
    const Eigen::Vector3f normal = candidate.T_view_model.linear() * model.surface[point].normal;
    const int u = pixel % map.width, v = pixel / map.width;
    for (int row = std::max(0, v - 1); row <= std::min(map.height - 1, v + 1); ++row) {
      for (int column = std::max(0, u - 1); column <= std::min(map.width - 1, u + 1); ++column) {
        const int i = row * map.width + column;
        if (map.measured(i) && std::abs(normal.dot(map.points[i] - p)) <= tolerance) owner[i] = index;
      }
    }
  }
}

/// The owners of what lies in front of a pose's surface, where they hide more than a trace of it.
std::vector<int> find_occluders(const DepthMap& map, const Model& model, const Candidate& candidate, int index,
                                const std::vector<int>& owner) {
  std::map<int, int> hidden_by;
  const std::vector<std::uint16_t>& visible = visible_points(model, candidate.T_view_model);
  for (const std::uint16_t i : visible) {
    const Eigen::Vector3f p = candidate.T_view_model * model.surface[i].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0 || owner[pixel] == kNobody || owner[pixel] == index) continue;
    if (map.points[pixel].z() < p.z() - kInFront * static_cast<float>(model.diameter)) ++hidden_by[owner[pixel]];
  }
  std::vector<int> occluders;
  for (const auto& [other, count] : hidden_by) {
    if (count > kTrace * static_cast<double>(visible.size())) occluders.push_back(other);
  }
  return occluders;
}

}  // namespace

std::vector<Candidate> rank(const DepthMap& map, std::span<const Model* const> models,
                            std::span<const VerifyOptions> options, std::vector<Candidate> candidates, double min_score,
                            const RunControl& control) {
  const auto better = [](const Candidate& a, const Candidate& b) { return a.score() > b.score(); };
  std::stable_sort(candidates.begin(), candidates.end(), better);
  std::vector<int> owner(map.points.size(), kNobody);
  std::vector<Candidate> accepted;
  std::size_t next = 0;
  while (next < candidates.size() && candidates[next].score() >= min_score && !control.stop.stop_requested()) {
    Candidate& candidate = candidates[next];
    const Model& model = *models[candidate.model_index];
    const float before = candidate.score();
    if (!candidate.has_variant) {
      VariantChoice choice = choose_variant(map, model, candidate.T_view_model, options[candidate.model_index]);
      candidate.has_variant = true;
      candidate.T_view_model = choice.T_view_model;
      candidate.confidence = choice.confidence;
      candidate.rivals = std::move(choice.rivals);
    }
    candidate.evidence = verify(map, model, candidate.T_view_model, options[candidate.model_index], &owner);
    if (candidate.score() < before) {
      // Lost pixels to a better one: back into line.
      const Candidate moved = candidate;
      const auto place =
          std::upper_bound(candidates.begin() + static_cast<std::ptrdiff_t>(next) + 1, candidates.end(), moved, better);
      std::move(candidates.begin() + static_cast<std::ptrdiff_t>(next) + 1, place,
                candidates.begin() + static_cast<std::ptrdiff_t>(next));
      *(place - 1) = moved;
      continue;
    }
    own_pixels(map, model, candidate, options[candidate.model_index].tolerance, static_cast<int>(accepted.size()),
               owner);
    accepted.push_back(candidate);
    ++next;
  }
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    accepted[i].occluded_by =
        find_occluders(map, *models[accepted[i].model_index], accepted[i], static_cast<int>(i), owner);
  }
  return accepted;
}

}  // namespace binpose

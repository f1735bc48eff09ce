#include "core/detect/rank.h"

#include <algorithm>
#include <cmath>

namespace binpose {
namespace {

/// Marks the pixels that a pose explains: those around each visible model point that measure the same surface.
void own_pixels(const DepthMap& map, const Model& model, const Candidate& candidate, float tolerance,
                std::vector<std::uint8_t>& owned) {
  for (const std::uint16_t index : visible_points(model, candidate.T_view_model)) {
    const Eigen::Vector3f p = candidate.T_view_model * model.surface[index].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0) continue;
    const Eigen::Vector3f normal = candidate.T_view_model.linear() * model.surface[index].normal;
    const int u = pixel % map.width, v = pixel / map.width;
    for (int row = std::max(0, v - 1); row <= std::min(map.height - 1, v + 1); ++row) {
      for (int column = std::max(0, u - 1); column <= std::min(map.width - 1, u + 1); ++column) {
        const int i = row * map.width + column;
        if (map.measured(i) && std::abs(normal.dot(map.points[i] - p)) <= tolerance) owned[i] = 1;
      }
    }
  }
}

}  // namespace

std::vector<Candidate> rank(const DepthMap& map, std::span<const Model* const> models, const VerifyOptionsOf& options,
                            std::vector<Candidate> candidates, double min_score) {
  const auto better = [](const Candidate& a, const Candidate& b) { return a.evidence.score() > b.evidence.score(); };
  std::stable_sort(candidates.begin(), candidates.end(), better);
  std::vector<std::uint8_t> owned(map.points.size(), 0);
  std::vector<Candidate> accepted;
  std::size_t next = 0;
  while (next < candidates.size() && candidates[next].evidence.score() >= min_score) {
    Candidate& candidate = candidates[next];
    const Model& model = *models[candidate.model_index];
    const float before = candidate.evidence.score();
    candidate.evidence = verify(map, model, candidate.T_view_model, options[candidate.model_index], &owned);
    if (candidate.evidence.score() < before) {
      // Lost pixels to a better one: back into line.
      const Candidate moved = candidate;
      const auto place =
          std::upper_bound(candidates.begin() + static_cast<std::ptrdiff_t>(next) + 1, candidates.end(), moved, better);
      std::move(candidates.begin() + static_cast<std::ptrdiff_t>(next) + 1, place,
                candidates.begin() + static_cast<std::ptrdiff_t>(next));
      *(place - 1) = moved;
      continue;
    }
    own_pixels(map, model, candidate, options[candidate.model_index].tolerance, owned);
    accepted.push_back(candidate);
    ++next;
  }
  return accepted;
}

}  // namespace binpose

#include "core/model.h"

#include <algorithm>

#include "core/heap_bytes.h"

namespace binpose {
namespace {

/// Noise of a scene pair's feature angles that a look-up forgives, radians (6 degrees: half a bin of the paper's).
constexpr double kBinMargin = 0.10471975511965977;

/// Per viewpoint: the points that it sees.
std::vector<std::vector<std::uint16_t>> seen_by_view(const std::vector<ViewMask>& masks, std::size_t view_count,
                                                     const RunControl& control) {
  std::vector<std::vector<std::uint16_t>> seen(view_count);
  for (std::size_t i = 0; i < masks.size() && !control.interrupted_at(i); ++i) {
    for (std::size_t k = 0; k < view_count; ++k) {
      if (sees(masks[i], static_cast<int>(k))) seen[k].push_back(static_cast<std::uint16_t>(i));
    }
  }
  return seen;
}

}  // namespace

void derive(Model& model, const RunControl& control) {
  model.centre = 0.5 * (model.box_min + model.box_max);
  model.viewpoints = view_directions(model.params.viewpoint_count);
  model.visible_from = seen_by_view(model.visibility, model.viewpoints.size(), control);
  model.telling_from = seen_by_view(model.telling_visibility, model.viewpoints.size(), control);
  model.view_area.assign(model.viewpoints.size(), 0);
  float sum = 0;
  for (std::size_t k = 0; k < model.viewpoints.size(); ++k) {
    for (const std::uint16_t i : model.visible_from[k]) {
      model.view_area[k] += std::max(0.0F, model.surface[i].normal.dot(model.viewpoints[k]));
    }
    sum += model.view_area[k];
  }
  const float mean = sum / static_cast<float>(model.viewpoints.size());
  for (float& area : model.view_area) area /= std::max(mean, 1e-6F);
  if (control.interrupted()) return;
  model.pair_table =
      PairTable(model.pair_points, model.pairs, model.pair_weights, model.centre.cast<float>(),
                static_cast<int>(model.params.pair_lengths.size()), model.params.bin_width, kBinMargin, control);
  if (control.interrupted()) return;
  model.contour_table = ContourTable(model.contour_points, model.contour_pairs, model.contour_weights,
                                     model.centre.cast<float>(), static_cast<float>(model.diameter), control);
}

std::size_t memory_bytes(const Model& model) {
  return sizeof(model) + heap_bytes(model.surface) + heap_bytes(model.visibility) + heap_bytes(model.outlines) +
         heap_bytes(model.pair_points) + heap_bytes(model.pairs) + heap_bytes(model.pair_weights) +
         heap_bytes(model.contour_points) + heap_bytes(model.contour_pairs) + heap_bytes(model.contour_weights) +
         heap_bytes(model.similar_poses) + heap_bytes(model.telling_points) + heap_bytes(model.telling_visibility) +
         heap_bytes(model.viewpoints) + heap_bytes(model.visible_from) + heap_bytes(model.telling_from) +
         heap_bytes(model.view_area) + model.pair_table.memory_bytes() + model.contour_table.memory_bytes();
}

}  // namespace binpose

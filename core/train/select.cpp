#include "core/train/select.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace binpose {

double pair_value(double obs, double ph, const TrainParams& params) {
  switch (params.selection) {
    case PairSelection::kDistinctiveness:
      return 1 - ph;
    case PairSelection::kObservability:
      return obs;
    case PairSelection::kIntegration:
      return params.observability_weight * obs + params.distinctiveness_weight * (1 - ph);
    case PairSelection::kSignalToNoise:
      return obs / std::sqrt(ph);
  }
  return 0;
}

std::vector<std::size_t> best_pairs(std::span<const double> values, std::size_t count) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), 0);
  count = std::min(count, order.size());
  std::partial_sort(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
      [&](std::size_t a, std::size_t b) { return values[a] != values[b] ? values[a] > values[b] : a < b; });
  order.resize(count);
  return order;
}

}  // namespace binpose

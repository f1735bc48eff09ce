#include "core/train/select.h"

#include <algorithm>
#include <cmath>

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

std::vector<std::size_t> best_pairs(std::span<const double> values, std::size_t count, const RunControl& control) {
  constexpr std::size_t kBlock = 1 << 16;  // between two looks at `control`: a millisecond or two
  const auto better = [&](std::size_t a, std::size_t b) {
    return values[a] != values[b] ? values[a] > values[b] : a < b;
  };
  std::vector<std::size_t> best;
  for (std::size_t first = 0; first < values.size(); first += kBlock) {
    if (control.interrupted()) return {};
    for (std::size_t i = first; i < std::min(values.size(), first + kBlock); ++i) best.push_back(i);
    if (best.size() <= count) continue;
    std::nth_element(best.begin(), best.begin() + static_cast<std::ptrdiff_t>(count), best.end(), better);
    best.resize(count);
  }
  std::sort(best.begin(), best.end(), better);
  return best;
}

}  // namespace binpose

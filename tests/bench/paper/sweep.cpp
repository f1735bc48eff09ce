#include <algorithm>
#include <cmath>

#include "tests/bench/paper/over_scenes.h"
#include "tests/bench/paper/runs.h"
#include "tests/bench/paper/vector_pairs.h"

namespace binpose::paper {
namespace {

constexpr int kPercents[] = {1, 2, 5, 10, 20, 50};  // N_vp, of the model points
/// w1 : w2 of [Eq. 7].
constexpr std::pair<double, double> kWeights[] = {{0, 1}, {1, 8}, {1, 4}, {1, 2}, {1, 1},
                                                  {2, 1}, {4, 1}, {8, 1}, {1, 0}};

/// The model with the best `percent` of its points as pairs.
Model with_fewer_pairs(Model model, int percent) {
  const auto count =
      static_cast<std::size_t>(std::ceil(0.01 * percent * static_cast<double>(model.pair_points.size())));
  model.pairs.resize(std::min(count, model.pairs.size()));
  model.pair_weights.resize(model.pairs.size());
  derive(model);
  return model;
}

std::string text(double number) {
  std::string digits = std::to_string(number);
  return digits.substr(0, digits.find('.'));
}

NamedFinders train_all(const testing::ScenePart& part) {
  NamedFinders finders;
  for (const auto& [name, selection] : selections()) {
    TrainParams params = TrainParams::paper();
    const int usual = static_cast<int>(std::lround(100 * params.pairs_per_point));
    params.selection = selection;
    params.pairs_per_point = 0.01 * *std::max_element(std::begin(kPercents), std::end(kPercents));
    const Model model = train_model(part, params);
    for (const int percent : kPercents) {
      finders.emplace_back("pairs " + name + " " + std::to_string(percent),
                           finder(with_fewer_pairs(model, percent), paper_detection(true)));
    }
    finders.emplace_back("unrefined " + name, finder(with_fewer_pairs(model, usual), paper_detection(false)));
  }
  for (const auto& [observability, distinctiveness] : kWeights) {
    TrainParams params = TrainParams::paper();
    params.observability_weight = observability;
    params.distinctiveness_weight = distinctiveness;
    finders.emplace_back("weights " + text(observability) + ":" + text(distinctiveness),
                         finder(train_model(part, params), paper_detection(true)));
  }
  return finders;
}

}  // namespace

void run_sweep(const std::filesystem::path& parts, const std::filesystem::path& scenes,
               const std::filesystem::path& output, Share share) {
  measure_over_scenes("sweep", parts, scenes, output, train_all, share);
}

}  // namespace binpose::paper

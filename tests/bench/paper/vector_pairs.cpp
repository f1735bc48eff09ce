#include "tests/bench/paper/vector_pairs.h"

#include <memory>
#include <stdexcept>

#include "core/detect/detect.h"
#include "core/train/train.h"

namespace binpose::paper {

const std::vector<std::pair<std::string, PairSelection>>& selections() {
  static const std::vector<std::pair<std::string, PairSelection>> all = {
      {"distinctiveness", PairSelection::kDistinctiveness},
      {"observability", PairSelection::kObservability},
      {"integration", PairSelection::kIntegration}};
  return all;
}

DetectParams paper_detection(bool refine) {
  DetectParams params = DetectParams::paper();
  params.refine = refine;
  return params;
}

Model train_model(const testing::ScenePart& part, const TrainParams& params) {
  absl::StatusOr<Model> model = train(part.mesh, params, {.threads = 1});
  if (!model.ok()) throw std::runtime_error(part.name + ": " + model.status().ToString());
  return *std::move(model);
}

Finder finder(Model model, const DetectParams& params) {
  return [model = std::make_shared<const Model>(std::move(model)), params](const PointCloud& cloud) {
    const Model* const models[] = {model.get()};
    absl::StatusOr<DetectResult> result = detect(cloud, models, params, {.threads = 1});
    if (!result.ok()) throw std::runtime_error(result.status().ToString());
    return std::move(result->hypotheses);
  };
}

}  // namespace binpose::paper

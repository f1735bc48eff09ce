#include "tests/bench/paper/vector_pairs.h"

namespace binpose::paper {

std::vector<Method> all_methods() {
  std::vector<Method> methods = {{"shot", train_shot_grouping}, {"fpfh", train_fpfh_ransac}};
  for (const auto& [name, selection] : selections()) {
    methods.push_back({name, [selection = selection](const testing::ScenePart& part) {
                         TrainParams params = TrainParams::paper();
                         params.selection = selection;
                         return finder(train_model(part, params), paper_detection(true));
                       }});
  }
  methods.push_back({"binpose", [](const testing::ScenePart& part) { return finder(train_model(part, {}), {}); }});
  return methods;
}

}  // namespace binpose::paper

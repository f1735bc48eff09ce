#include "tests/bench/paper/over_scenes.h"
#include "tests/bench/paper/runs.h"

namespace binpose::paper {

void run_table(const std::filesystem::path& parts, const std::filesystem::path& scenes,
               const std::filesystem::path& output, Share share) {
  const auto train = [](const testing::ScenePart& part) {
    NamedFinders finders;
    for (const Method& method : all_methods()) finders.emplace_back(method.name, method.train(part));
    return finders;
  };
  measure_over_scenes("table", parts, scenes, output, train, share);
}

}  // namespace binpose::paper

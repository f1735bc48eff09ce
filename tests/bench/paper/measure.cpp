#include "tests/bench/paper/measure.h"

#include <ctime>

namespace binpose::paper {

Json measure(const Finder& find, const testing::BinScene& scene, const testing::PoseJudge& judge) {
  const std::clock_t start = std::clock();
  const std::vector<PoseHypothesis> poses = find(scene.cloud);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const testing::SceneScore score = judge.score(poses, scene.instances);
  return {{"best_right", score.best_right},
          {"instances", score.instances},
          {"hits", score.hits},
          {"wrong", score.wrong},
          {"seconds", seconds}};
}

}  // namespace binpose::paper

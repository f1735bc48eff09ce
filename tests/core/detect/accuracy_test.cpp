/// Whole scenes of tests/data through training and detection, against their truth.
#include <gtest/gtest.h>

#include <map>

#include "core/detect/detect.h"
#include "core/train/train.h"
#include "tests/support/bin_scene.h"
#include "tests/support/scene_score.h"

namespace binpose {
namespace {

using testing::BinScene;
using testing::PoseJudge;
using testing::SceneScore;

constexpr int kThreads = 2;

struct TrainedPart {
  Model model;
  PoseJudge judge;
};

/// Each part trained once for all tests.
const TrainedPart& trained(const std::string& name) {
  static std::map<std::string, TrainedPart> parts;
  if (const auto found = parts.find(name); found != parts.end()) return found->second;
  for (const testing::ScenePart& part : testing::read_parts(BINPOSE_TEST_DATA "/parts")) {
    if (part.name != name) continue;
    absl::StatusOr<Model> model = train(part.mesh, TrainParams(), RunControl{.threads = kThreads});
    if (!model.ok()) throw std::runtime_error(std::string(model.status().message()));
    return parts.emplace(name, TrainedPart{*std::move(model), PoseJudge(part)}).first->second;
  }
  throw std::runtime_error("no part " + name);
}

BinScene scene(const std::string& name) {
  return testing::read_scene(std::string(BINPOSE_TEST_DATA "/scenes/") + name);
}

DetectResult found(const PointCloud& cloud, const std::string& part) {
  const Model* const models[] = {&trained(part).model};
  absl::StatusOr<DetectResult> result = detect(cloud, models, DetectParams(), RunControl{.threads = kThreads});
  if (!result.ok()) throw std::runtime_error(std::string(result.status().message()));
  return *std::move(result);
}

TEST(Accuracy, FindsNearlyAllWellVisiblePartsAndInventsNearlyNone) {
  SceneScore sum;
  for (const char* name : {"bearing_support_01", "bearing_support_02", "bearing_support_03", "spindle_01"}) {
    const BinScene bin = scene(name);
    const SceneScore score = trained(bin.part).judge.score(found(bin.cloud, bin.part).hypotheses, bin.instances);
    EXPECT_EQ(score.best_right, 1) << name;
    sum += score;
  }
  ASSERT_GT(sum.instances, 50);
  EXPECT_GE(sum.recall(), 0.95);
  EXPECT_GE(sum.precision(), 0.95);
}

TEST(Accuracy, FindsFlatPartsByTheirRims) {
  const BinScene bin = scene("lock_plate_01");
  const SceneScore score = trained(bin.part).judge.score(found(bin.cloud, bin.part).hypotheses, bin.instances);
  EXPECT_EQ(score.best_right, 1);
  EXPECT_GE(score.recall(), 0.8);
}

TEST(Accuracy, FindsNothingInAnEmptyBinAndSaysWhy) {
  for (const char* part : {"bearing_support", "spindle", "gear_housing"}) {
    const DetectResult result = found(scene("empty_bin_01").cloud, part);
    EXPECT_TRUE(result.hypotheses.empty()) << part;
    EXPECT_FALSE(result.warnings.empty()) << part;
  }
}

TEST(Accuracy, FindsNextToNothingAmongOtherParts) {
  std::size_t invented = 0;
  for (const auto& [name, part] :
       {std::pair("bearing_support_01", "spindle"), std::pair("bearing_support_02", "spindle"),
        std::pair("spindle_01", "bearing_support"), std::pair("spindle_01", "gear_housing")}) {
    invented += found(scene(name).cloud, part).hypotheses.size();
  }
  EXPECT_LE(invented, 1);
}

TEST(Accuracy, AnUnorderedCloudServesAsWellAsTheDepthImage) {
  BinScene bin = scene("bearing_support_01");
  PointCloud unordered;
  for (const Eigen::Vector3f& p : bin.cloud.points) {
    if (p.allFinite()) unordered.points.push_back(p);
  }
  unordered.width = static_cast<std::uint32_t>(unordered.points.size());
  unordered.height = 1;
  const SceneScore score = trained(bin.part).judge.score(found(unordered, bin.part).hypotheses, bin.instances);
  EXPECT_GE(score.recall(), 0.9);
  EXPECT_GE(score.precision(), 0.9);
}

TEST(Accuracy, SearchesForSeveralPartsAtOnce) {
  const BinScene bin = scene("spindle_01");
  const Model* const models[] = {&trained("bearing_support").model, &trained("spindle").model};
  const absl::StatusOr<DetectResult> result =
      detect(bin.cloud, models, DetectParams(), RunControl{.threads = kThreads});
  ASSERT_TRUE(result.ok()) << result.status();
  std::vector<PoseHypothesis> spindles;
  for (const PoseHypothesis& hypothesis : result->hypotheses) {
    EXPECT_EQ(hypothesis.model_index, 1);
    if (hypothesis.model_index == 1) spindles.push_back(hypothesis);
  }
  EXPECT_GE(trained("spindle").judge.score(spindles, bin.instances).recall(), 0.9);
}

}  // namespace
}  // namespace binpose

#include "core/detect/detect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "core/train/train.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

/// Four blocks in poses of all kinds, of which enough shows to tell them from any other.
std::vector<testing::PlacedMesh> four_blocks() {
  const Mesh mesh = testing::l_block();
  return {{mesh, testing::pose(40, {1, 0.5, 0.2}, {-0.10, -0.05, 0.44})},
          {mesh, testing::pose(-60, {0.3, 1, 0.4}, {0.08, -0.09, 0.45})},
          {mesh, testing::pose(110, {0.3, 1, -0.5}, {0.08, 0.06, 0.45})},
          {mesh, testing::pose(50, {-1, 0.4, 0.3}, {-0.10, 0.04, 0.44})}};
}

absl::StatusOr<DetectResult> search(const PointCloud& cloud, const Model& model, const DetectParams& params = {},
                                    const RunControl& control = {}) {
  const Model* models[] = {&model};
  return detect(cloud, models, params, control);
}

bool right(const PoseHypothesis& found, const Pose& truth, const Model& model) {
  return (found.T_scene_model * model.centre - truth * model.centre).norm() < 0.02 * model.diameter &&
         rotation_distance(found.T_scene_model, truth) < 3 * kDegree;
}

TEST(Detect, FindsEachPartOnceAtItsPose) {
  const std::vector<testing::PlacedMesh> bodies = four_blocks();
  const Model model = testing::quick_model(testing::l_block());
  const DetectResult result = *search(testing::render(bodies, testing::bin_sensor()), model);
  ASSERT_GE(result.hypotheses.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    int hits = 0;
    for (const testing::PlacedMesh& body : bodies) {
      hits += static_cast<int>(right(result.hypotheses[i], body.T_scene_mesh, model));
    }
    EXPECT_EQ(hits, 1) << "rank " << i;
    EXPECT_GT(result.hypotheses[i].score, 0.6);
    EXPECT_LT(result.hypotheses[i].residual, 0.005 * model.diameter);
  }
  for (const testing::PlacedMesh& body : bodies) {
    int found = 0;
    for (const PoseHypothesis& h : result.hypotheses) found += static_cast<int>(right(h, body.T_scene_mesh, model));
    EXPECT_EQ(found, 1);
  }
  for (std::size_t i = 1; i < result.hypotheses.size(); ++i) {
    EXPECT_LE(result.hypotheses[i].score, result.hypotheses[i - 1].score);
  }
}

TEST(Detect, FindsPartsOfSeveralModelsAndSaysWhich) {
  const std::vector<testing::PlacedMesh> bodies = {
      {testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {-0.09, -0.03, 0.44})},
      {testing::stepped_shaft(), testing::pose(75, {1, 0.3, 0}, {0.06, -0.05, 0.46})},
      {testing::stepped_shaft(), testing::pose(100, {0.2, 1, 0}, {0.05, 0.06, 0.46})}};
  const Model block = testing::quick_model(testing::l_block()), shaft = testing::quick_model(testing::stepped_shaft());
  const Model* models[] = {&block, &shaft};
  const DetectResult result = *detect(testing::render(bodies, testing::bin_sensor()), models, {}, {});
  ASSERT_GE(result.hypotheses.size(), 3u);
  int blocks = 0, shafts = 0;
  for (int i = 0; i < 3; ++i) {
    const PoseHypothesis& h = result.hypotheses[i];
    if (h.model_index == 0) {
      blocks += static_cast<int>(right(h, bodies[0].T_scene_mesh, block));
      continue;
    }
    for (const int b : {1, 2}) {  // the turn about its axis is free
      const Pose& truth = bodies[b].T_scene_mesh;
      shafts +=
          static_cast<int>((h.T_scene_model * shaft.centre - truth * shaft.centre).norm() < 0.02 * shaft.diameter &&
                           h.T_scene_model.linear().col(2).dot(truth.linear().col(2)) > std::cos(3 * kDegree));
    }
  }
  EXPECT_EQ(blocks, 1);
  EXPECT_EQ(shafts, 2);
}

TEST(Detect, GivesPosesInTheFrameOfTheCloud) {
  const std::vector<testing::PlacedMesh> bodies = four_blocks();
  const Model model = testing::quick_model(testing::l_block());
  PointCloud cloud = testing::render(bodies, testing::bin_sensor());
  const Pose T_robot_sensor = testing::pose(170, {1, 0.1, 0.3}, {0.5, -0.2, 1.1});
  for (Eigen::Vector3f& p : cloud.points) p = (T_robot_sensor * p.cast<double>()).cast<float>();
  cloud.sensor_position = T_robot_sensor.translation();
  const DetectResult result = *search(cloud, model);
  ASSERT_GE(result.hypotheses.size(), 4u);
  for (const testing::PlacedMesh& body : bodies) {
    int found = 0;
    for (const PoseHypothesis& h : result.hypotheses) {
      found += static_cast<int>(right(h, T_robot_sensor * body.T_scene_mesh, model));
    }
    EXPECT_EQ(found, 1);
  }
}

TEST(Detect, DoesNotNeedTheOrderOfThePoints) {
  const std::vector<testing::PlacedMesh> bodies = four_blocks();
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud grid = testing::render(bodies, testing::bin_sensor());
  PointCloud loose;
  for (std::size_t i = 0; i < grid.points.size(); ++i) {
    loose.points.push_back(grid.points[i * 7919 % grid.points.size()]);
  }
  loose.width = static_cast<std::uint32_t>(loose.points.size());
  loose.height = 1;
  const DetectResult expected = *search(grid, model), result = *search(loose, model);
  ASSERT_GE(result.hypotheses.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    int same = 0;
    for (const PoseHypothesis& h : result.hypotheses) {
      same += static_cast<int>(right(h, expected.hypotheses[i].T_scene_model, model));
    }
    EXPECT_EQ(same, 1);
  }
}

TEST(Detect, FindsAPartInACloudOfAllItsSides) {
  const Model model = testing::quick_model(testing::l_block());
  for (const testing::PlacedMesh& block : four_blocks()) {  // one looks the same turned, to who sees one side of it
    const PointCloud cloud = testing::all_sides(testing::l_block(), block.T_scene_mesh, 0.01 * model.diameter);
    const DetectResult result = *search(cloud, model);
    ASSERT_FALSE(result.hypotheses.empty());
    EXPECT_TRUE(right(result.hypotheses.front(), block.T_scene_mesh, model));
  }
}

TEST(Detect, GivesTheSameBitsOfACloudOfAllSidesOnAnyNumberOfThreads) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud =
      testing::all_sides(testing::l_block(), four_blocks()[1].T_scene_mesh, 0.015 * model.diameter);
  const DetectResult one = *search(cloud, model, {}, {.threads = 1}), three = *search(cloud, model, {}, {.threads = 3});
  ASSERT_EQ(one.hypotheses.size(), three.hypotheses.size());
  for (std::size_t i = 0; i < one.hypotheses.size(); ++i) {
    EXPECT_EQ(one.hypotheses[i].T_scene_model.matrix(), three.hypotheses[i].T_scene_model.matrix());
    EXPECT_EQ(one.hypotheses[i].score, three.hypotheses[i].score);
  }
}

TEST(Detect, FindsAPartInACoarseScan) {
  const Model model = testing::quick_model(testing::l_block());
  const testing::PlacedMesh part = {testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {-0.02, -0.03, 0.45})};
  testing::PinholeSensor coarse;
  coarse.width = 96;
  coarse.height = 72;
  coarse.focal = 0.45 / (0.025 * model.diameter);
  const DetectResult result = *search(testing::render({&part, 1}, coarse), model);
  ASSERT_FALSE(result.hypotheses.empty());
  EXPECT_TRUE(right(result.hypotheses.front(), part.T_scene_mesh, model));
}

TEST(Detect, FindsNothingOnABareFloor) {
  const Model model = testing::quick_model(testing::l_block());
  const absl::StatusOr<DetectResult> result = search(testing::render({}, testing::bin_sensor()), model);
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result->hypotheses.empty());
}

TEST(Detect, DoesNotFindAPartThatIsNotThere) {
  const Model shaft = testing::quick_model(testing::stepped_shaft());
  const DetectResult result = *search(testing::render(four_blocks(), testing::bin_sensor()), shaft);
  for (const PoseHypothesis& h : result.hypotheses) EXPECT_LT(h.score, 0.6);
}

TEST(Detect, CountsWhatItDid) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud = testing::render(four_blocks(), testing::bin_sensor());
  const DetectStats stats = search(cloud, model)->stats;
  EXPECT_EQ(stats.point_count, cloud.points.size());
  EXPECT_GT(stats.start_point_count, 100u);
  EXPECT_GT(stats.scene_pair_count, stats.start_point_count);
  EXPECT_GT(stats.vote_count, 1000u);
  EXPECT_GT(stats.cluster_count, 0u);
  EXPECT_GT(stats.verified_count, 0u);
  EXPECT_EQ(stats.stop_reason, StopReason::kComplete);
  EXPECT_GE(stats.total_seconds, stats.vote_seconds + stats.refine_seconds + stats.cluster_seconds);
}

TEST(Detect, ReturnsNothingBelowTheMinimumScore) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud = testing::render(four_blocks(), testing::bin_sensor());
  DetectParams params;
  params.min_score = 1;
  EXPECT_TRUE(search(cloud, model, params)->hypotheses.empty());
  params.min_score = 0.6;
  const DetectResult result = *search(cloud, model, params);
  for (const PoseHypothesis& h : result.hypotheses) EXPECT_GE(h.score, 0.6);
}

TEST(Detect, SaysThatNoPoseWasSureEnoughForThePartToBeThere) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud = testing::render(four_blocks(), testing::bin_sensor());
  const DetectResult present = *search(cloud, model);
  double best = 0;  // by which a pose proves the part
  for (const PoseHypothesis& h : present.hypotheses) {
    best = std::max(best, h.score * std::min(1.0, h.explained_area));
  }
  DetectParams params;
  params.presence_score = (best + 1) / 2;
  const DetectResult result = *search(cloud, model, params);
  EXPECT_TRUE(result.hypotheses.empty());
  ASSERT_EQ(result.warnings.size(), 1U);
  EXPECT_NE(result.warnings[0].find("less than presence_score"), std::string::npos);
  params.presence_score = 0.999 * best;
  EXPECT_GE(search(cloud, model, params)->hypotheses.size(), 1U);
  params.presence_score = 0.85 * best;  // so that no other pose has to prove it
  EXPECT_EQ(search(cloud, model, params)->hypotheses.size(), present.hypotheses.size());
}

TEST(Detect, SaysHowManyPartsAreLeftOutAsAmbiguousAndAnswersThemWhenAsked) {
  const Model model = testing::quick_model(testing::pinned_disc());
  std::vector<testing::PlacedMesh> bodies;  // the pin away from the sensor
  for (const double x : {-0.08, 0.0, 0.08}) {
    bodies.push_back({testing::pinned_disc(), testing::pose(10 + 50 * x, Vector3d::UnitX(), {x, 0, 0.45})});
  }
  const PointCloud cloud = testing::render(bodies, testing::bin_sensor());
  const DetectResult strict = *search(cloud, model);
  EXPECT_TRUE(strict.hypotheses.empty());
  ASSERT_EQ(strict.warnings.size(), 1U);
  EXPECT_EQ(strict.warnings[0].find("3 more places"), 0U) << strict.warnings[0];
  DetectParams params;
  params.accept_ambiguous = true;
  const DetectResult lenient = *search(cloud, model, params);
  EXPECT_TRUE(lenient.warnings.empty());
  ASSERT_EQ(lenient.hypotheses.size(), 3U);
  for (const PoseHypothesis& h : lenient.hypotheses) {
    EXPECT_GT(h.score, 0.5);
    EXPECT_LT(h.confidence, 0.3);
    EXPECT_GE(h.variants.size(), 20U);
  }
}

TEST(Detect, AnswersApartWhatScoredTooLittleAndChangesNothingElse) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud = testing::render(four_blocks(), testing::bin_sensor());
  const DetectResult all = *search(cloud, model);
  ASSERT_GE(all.hypotheses.size(), 2U);
  DetectParams params;
  params.min_score = (all.hypotheses.front().score + all.hypotheses.back().score) / 2;
  const DetectResult plain = *search(cloud, model, params);
  params.max_rejected = 2;
  const DetectResult result = *search(cloud, model, params);
  EXPECT_TRUE(plain.rejected.empty());
  ASSERT_FALSE(result.rejected.empty());
  EXPECT_LE(result.rejected.size(), 2U);
  for (const PoseHypothesis& h : result.rejected) EXPECT_LT(h.score, params.min_score);
  ASSERT_EQ(result.hypotheses.size(), plain.hypotheses.size());
  for (std::size_t i = 0; i < plain.hypotheses.size(); ++i) {
    EXPECT_EQ(result.hypotheses[i].score, plain.hypotheses[i].score);
    EXPECT_EQ(result.hypotheses[i].occluded_by, plain.hypotheses[i].occluded_by);
  }
}

TEST(Detect, IsBitIdenticalOnAnyNumberOfThreadsAndOnRepetition) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud = testing::render(four_blocks(), testing::bin_sensor());
  const DetectResult once = *search(cloud, model);
  for (const int threads : {1, 2, 4}) {
    RunControl control;
    control.threads = threads;
    const DetectResult again = *search(cloud, model, {}, control);
    ASSERT_EQ(again.hypotheses.size(), once.hypotheses.size()) << threads;
    EXPECT_EQ(again.stats.vote_count, once.stats.vote_count);
    EXPECT_EQ(again.stats.cluster_count, once.stats.cluster_count);
    EXPECT_EQ(again.stats.verified_count, once.stats.verified_count);
    for (std::size_t i = 0; i < once.hypotheses.size(); ++i) {
      EXPECT_EQ(again.hypotheses[i].T_scene_model.matrix(), once.hypotheses[i].T_scene_model.matrix());
      EXPECT_EQ(again.hypotheses[i].score, once.hypotheses[i].score);
      EXPECT_EQ(again.hypotheses[i].votes, once.hypotheses[i].votes);
    }
  }
}

TEST(Detect, IsCancelledBeforeOrWhileItWorks) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud = testing::render(four_blocks(), testing::bin_sensor());
  std::stop_source source;
  RunControl control;
  control.stop = source.get_token();
  source.request_stop();
  EXPECT_EQ(search(cloud, model, {}, control).status().code(), absl::StatusCode::kCancelled);

  // Many models: far more work than the moment until the stop.
  std::stop_source later;
  control.stop = later.get_token();
  const std::vector<const Model*> models(200, &model);
  std::jthread stopper([&] { later.request_stop(); });
  EXPECT_EQ(detect(cloud, models, {}, control).status().code(), absl::StatusCode::kCancelled);
}

TEST(Detect, AtItsDeadlineAnswersWithWhatItHas) {
  const Model model = testing::quick_model(testing::l_block());
  const PointCloud cloud = testing::render(four_blocks(), testing::bin_sensor());
  RunControl control;
  control.deadline = std::chrono::steady_clock::now();
  const absl::StatusOr<DetectResult> result = search(cloud, model, {}, control);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->stats.stop_reason, StopReason::kDeadline);
}

TEST(Detect, ReturnsNoMoreThanAskedFor) {
  const Model model = testing::quick_model(testing::l_block());
  DetectParams params;
  params.max_results = 2;
  const DetectResult result = *search(testing::render(four_blocks(), testing::bin_sensor()), model, params);
  EXPECT_EQ(result.hypotheses.size(), 2u);
  EXPECT_EQ(result.stats.stop_reason, StopReason::kMaxResults);
}

TEST(Detect, RefusesBadParametersAndNoModel) {
  const Model model = testing::quick_model(testing::hexagon());
  const PointCloud cloud = testing::render({}, testing::bin_sensor());
  DetectParams params;
  params.max_results = 0;
  EXPECT_EQ(search(cloud, model, params).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(detect(cloud, {}, {}, {}).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace binpose

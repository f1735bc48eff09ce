#include "core/train/train.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/io/model_file.h"
#include "core/train/vector_pairs.h"
#include "core/train/visibility.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

TrainParams quick() {
  TrainParams params;
  params.viewpoint_count = 100;
  return params;
}

TEST(Train, KeepsExtentAndParameters) {
  const absl::StatusOr<Model> model = train(testing::box({0.03F, 0.04F, 0.12F}), quick(), {});
  ASSERT_TRUE(model.ok());
  EXPECT_NEAR(model->diameter, 0.13, 1e-6);
  EXPECT_TRUE(model->box_max.isApprox(Eigen::Vector3d(0.015, 0.02, 0.06), 1e-6));
  EXPECT_TRUE(model->centre.isZero(1e-9));
  EXPECT_EQ(model->params, quick());
}

TEST(Train, SelectsRightAngledPairsOfTheGivenLengthsThatSomeViewShows) {
  const absl::StatusOr<Model> model = train(testing::l_block(), quick(), {});
  ASSERT_TRUE(model.ok());
  const double tolerance = model->params.relative_length_tolerance * model->diameter * 1.001;
  ASSERT_EQ(model->pair_weights.size(), model->pairs.size());
  EXPECT_EQ(model->pairs.size(), 2 * std::ceil(3 * model->pair_points.size()));
  std::set<int> scales;
  for (const VectorPair& v : model->pairs) {
    scales.insert(v.scale);
    const PairLengths& lengths = model->params.pair_lengths[v.scale];
    const Eigen::Vector3f a = model->pair_points[v.q1].position - model->pair_points[v.p].position;
    const Eigen::Vector3f b = model->pair_points[v.q2].position - model->pair_points[v.p].position;
    EXPECT_NEAR(a.norm(), lengths.relative_q1 * model->diameter, tolerance);
    EXPECT_NEAR(b.norm(), lengths.relative_q2 * model->diameter, tolerance);
    EXPECT_LE(std::abs(a.normalized().dot(b.normalized())), kRightAngleCosine * 1.001F);
  }
  EXPECT_EQ(scales.size(), 2u);
}

TEST(Train, KeepsTheShareOfPairsThatThePaperSays) {
  TrainParams params = TrainParams::paper();
  params.viewpoint_count = 100;
  const absl::StatusOr<Model> model = train(testing::l_block(), params, {});
  ASSERT_TRUE(model.ok());
  EXPECT_EQ(model->pairs.size(), std::ceil(0.1 * static_cast<double>(model->pair_points.size())));
}

TEST(Train, EachSelectionKeepsTheBestByItsOwnMeasure) {
  const auto distinct_mean = [](PairSelection selection) {
    TrainParams params = quick();
    params.pair_lengths = {{0.30, 0.22}};
    params.pairs_per_point = 1;
    params.selection = selection;
    const Model model = *train(testing::l_block(), params, {});
    double sum = 0;
    for (const float weight : model.pair_weights) sum += weight;  // rises with the distinctiveness
    return sum / static_cast<double>(model.pair_weights.size());
  };
  EXPECT_GT(distinct_mean(PairSelection::kDistinctiveness), distinct_mean(PairSelection::kIntegration));
  EXPECT_GT(distinct_mean(PairSelection::kSignalToNoise), distinct_mean(PairSelection::kObservability));
}

/// The mesh with every n-th triangle wound the other way.
Mesh with_turned(Mesh mesh, std::size_t n) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += n) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  return mesh;
}

/// A tube that is too narrow to look far into.
Mesh tube() {
  const Eigen::Vector2f profile[] = {
      {0.003F, 0.05F}, {0.003F, -0.05F}, {0.015F, -0.05F}, {0.015F, 0.05F}, {0.003F, 0.05F}};
  Mesh mesh = testing::revolve(profile, 32);
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) corner %= 4 * 32;  // the last ring is the first
  }
  return mesh;
}

double mean_observability(const Model& model) {
  double sum = 0;
  for (const ViewMask& mask : model.visibility) sum += observability(mask, model.params.viewpoint_count);
  return sum / static_cast<double>(model.visibility.size());
}

TEST(Train, OrientsTheSurfaceHoweverItIsWound) {
  for (const Mesh& mesh : {testing::l_block(), tube()}) {
    const double expected = mean_observability(*train(mesh, quick(), {}));
    for (const std::size_t n : {1, 2}) {
      EXPECT_NEAR(mean_observability(*train(with_turned(mesh, n), quick(), {})), expected, 0.02 * expected);
    }
  }
}

TEST(Train, KeepsTheNormalsOfAThinPlateAndOfADeepBore) {
  const Model plate = *train(testing::box({0.1F, 0.06F, 0.0005F}), quick(), {});
  for (const SurfacePoint& p : plate.surface) EXPECT_GT(p.normal.dot(p.position), 0);
  const Model bored = *train(with_turned(tube(), 1), quick(), {});
  for (const SurfacePoint& p : bored.surface) {
    if (std::abs(p.normal.z()) > 0.5F) continue;
    EXPECT_EQ(p.normal.head<2>().dot(p.position.head<2>()) > 0, p.position.head<2>().norm() > 0.009F);
  }
}

TEST(Train, WarnsOfWhatIsWrongWithTheMesh) {
  EXPECT_THAT(train(testing::l_block(), quick(), {})->warnings, ::testing::IsEmpty());
  EXPECT_THAT(train(with_turned(testing::l_block(), 1), quick(), {})->warnings,
              ::testing::ElementsAre(::testing::HasSubstr("inside out")));
  const Mesh crate = testing::box({0.1F, 0.1F, 0.1F});
  EXPECT_THAT(train(testing::joined(crate, testing::box({0.05F, 0.05F, 0.05F})), quick(), {})->warnings,
              ::testing::ElementsAre(::testing::HasSubstr("21 % of the mesh's surface can't be seen")));
}

TEST(Train, IsBitIdenticalOnAnyNumberOfThreadsAndOnRepetition) {
  const std::string once = serialize_model(*train(testing::l_block(), quick(), {}));
  for (const int threads : {1, 2, 4}) {
    RunControl control;
    control.threads = threads;
    EXPECT_TRUE(serialize_model(*train(testing::l_block(), quick(), control)) == once) << threads;
  }
}

TEST(Train, TellsItsStagesWithRisingProgress) {
  std::vector<TrainStage> stages;
  double last = 0;
  const auto observer = [&](TrainStage stage, double progress) {
    EXPECT_GE(progress, last);
    EXPECT_LE(progress, 1);
    last = progress;
    if (stages.empty() || stages.back() != stage) stages.push_back(stage);
  };
  ASSERT_TRUE(train(testing::hexagon(), quick(), {}, observer).ok());
  EXPECT_THAT(stages, ::testing::ElementsAre(TrainStage::kSampling, TrainStage::kVisibility, TrainStage::kVectorPairs,
                                             TrainStage::kSymmetry));
}

TEST(Train, CanBeCancelledAtEachStage) {
  for (const TrainStage when : {TrainStage::kSampling, TrainStage::kVisibility, TrainStage::kVectorPairs}) {
    std::stop_source source;
    RunControl control;
    control.stop = source.get_token();
    const auto observer = [&](TrainStage stage, double) {
      EXPECT_LE(stage, when) << "went on after the stop";
      if (stage == when) source.request_stop();
    };
    EXPECT_EQ(train(testing::l_block(), quick(), control, observer).status().code(), absl::StatusCode::kCancelled);
  }
}

TEST(Train, EndsAtItsDeadline) {
  RunControl control;
  control.deadline = std::chrono::steady_clock::now();
  EXPECT_EQ(train(testing::l_block(), quick(), control).status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(Train, RefusesBadParametersAndMeshes) {
  TrainParams params = quick();
  params.viewpoint_count = 3;
  EXPECT_EQ(train(testing::l_block(), params, {}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(train(Mesh{}, quick(), {}).status().code(), absl::StatusCode::kInvalidArgument);
}

/// Odd but legal meshes: what comes out must be usable or refused, not crash.
TEST(Train, SurvivesOddMeshes) {
  Mesh sheet;
  sheet.vertices = {{0, 0, 0}, {0.1F, 0, 0}, {0, 0.1F, 0}};
  sheet.triangles = {{0, 1, 2}};
  Mesh needle = testing::box({0.1F, 1e-5F, 1e-5F});
  Mesh twice = testing::joined(testing::l_block(), testing::l_block());
  Mesh specks = testing::joined(testing::box({1e-4F, 1e-4F, 1e-4F}),
                                testing::shifted(testing::box({1e-4F, 1e-4F, 1e-4F}), {5, 0, 0}));
  for (const Mesh& mesh : {sheet, needle, twice, specks, testing::sphere(0.05F)}) {
    const absl::StatusOr<Model> model = train(mesh, quick(), {});
    if (!model.ok()) {
      EXPECT_EQ(model.status().code(), absl::StatusCode::kInvalidArgument);
      EXPECT_FALSE(model.status().message().empty());
    } else {
      EXPECT_TRUE(parse_model(serialize_model(*model)).ok());
    }
  }
}

}  // namespace
}  // namespace binpose

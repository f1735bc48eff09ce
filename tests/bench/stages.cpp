/// Time and throughput of each stage of a detection, on one scan of the project's own.
///
///   binpose-bench-stages [PARTS SCENE] [--benchmark_filter=REGEX] [--benchmark_repetitions=N] ...
#include <benchmark/benchmark.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "core/detect/cluster.h"
#include "core/detect/contour_votes.h"
#include "core/detect/detect.h"
#include "core/detect/judge.h"
#include "core/detect/rank.h"
#include "core/detect/refine.h"
#include "core/detect/scene_points.h"
#include "core/detect/search.h"
#include "core/detect/vote.h"
#include "core/geometry/contours.h"
#include "core/geometry/normals.h"
#include "core/train/train.h"
#include "tests/support/bin_scene.h"
#include "tests/support/scan_map.h"

namespace {

using namespace binpose;  // NOLINT
using benchmark::State;

/// What the stages work on: the answer of each is what the next one takes.
struct Bench {
  testing::ScenePart part;
  PointCloud cloud;
  Model model;
  SensorView view;
  DepthMap map;
  ScenePoints scene;
  std::vector<int> starts;
  Votes votes;
  std::vector<Candidate> candidates;
  DetectParams params;
};

Bench make_bench(const std::filesystem::path& parts, const std::filesystem::path& folder) {
  constexpr int kBlock = 3;
  testing::BinScene scan = testing::read_scene(folder);
  Bench bench;
  for (testing::ScenePart& part : testing::read_parts(parts)) {
    if (part.name == scan.part) bench.part = std::move(part);
  }
  bench.cloud = std::move(scan.cloud);
  bench.model = train(bench.part.mesh, {}, {}).value();
  bench.view = sensor_view(bench.cloud).value();
  bench.map = testing::scan_map(bench.cloud, bench.model.diameter);
  bench.scene = down_sample(bench.map, kBlock);
  bench.starts = start_points(bench.scene, bench.params.start_point_share);
  bench.votes = vote(bench.scene, bench.starts, bench.map, bench.model, bench.params, {});
  DetectStats stats;
  bench.candidates = search(bench.map, bench.model, 0, bench.params, {}, stats);
  return bench;
}

/// Each run's items by the second, for example points or votes.
void count(State& state, const char* unit, std::size_t items) {
  state.counters[unit] = benchmark::Counter(static_cast<double>(items), benchmark::Counter::kIsIterationInvariantRate);
}

void train_part(State& state, const Bench& bench) {
  for (auto _ : state) benchmark::DoNotOptimize(train(bench.part.mesh, {}, {}));
  count(state, "triangles", bench.part.mesh.triangles.size());
}

void view_cloud(State& state, const Bench& bench) {
  for (auto _ : state) benchmark::DoNotOptimize(sensor_view(bench.cloud));
  count(state, "points", bench.view.points.size());
}

void map_depth(State& state, const Bench& bench) {
  for (auto _ : state) benchmark::DoNotOptimize(depth_map(bench.view, bench.map.pixel_size));
  count(state, "points", bench.view.points.size());
}

void find_normals(State& state, const Bench& bench) {
  DepthMap map = bench.map;
  for (auto _ : state) estimate_normals(map, static_cast<int>(state.range(0)));
  count(state, "pixels", map.pixels.size());
}

void find_outlines(State& state, const Bench& bench) {
  DepthMap map = bench.map;
  const float step = 0.03F * static_cast<float>(bench.model.diameter);
  for (auto _ : state) find_contours(map, step, Unmeasured::kUnknown);
  count(state, "pixels", map.pixels.size());
}

void vote_by_surface(State& state, const Bench& bench) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(vote(bench.scene, bench.starts, bench.map, bench.model, bench.params, {}));
  }
  count(state, "pairs", bench.votes.scene_pairs);
}

void vote_by_contour(State& state, const Bench& bench) {
  std::size_t pairs = 0;
  for (auto _ : state) pairs = contour_votes(bench.map, bench.model, 1, {}).scene_pairs;
  count(state, "pairs", pairs);
}

void cluster_votes(State& state, const Bench& bench) {
  const auto diameter = static_cast<float>(bench.model.diameter);
  const ClusterOptions options = {.radius = 0.06F * diameter, .most = bench.params.cluster_limit};
  for (auto _ : state) benchmark::DoNotOptimize(cluster(bench.votes.votes, options));
  count(state, "votes", bench.votes.votes.size());
}

void refine_candidates(State& state, const Bench& bench) {
  const auto diameter = static_cast<float>(bench.model.diameter);
  const RefineOptions options = {.first_gate = 0.08F * diameter, .last_gate = 0.025F * diameter};
  for (auto _ : state) {
    for (const Candidate& candidate : bench.candidates) {
      benchmark::DoNotOptimize(refine(bench.map, bench.model, candidate.T_view_model, options));
    }
  }
  count(state, "poses", bench.candidates.size());
}

void verify_candidates(State& state, const Bench& bench) {
  const VerifyOptions options = final_verification(bench.map, bench.model);
  for (auto _ : state) {
    for (const Candidate& candidate : bench.candidates) {
      benchmark::DoNotOptimize(verify(bench.map, bench.model, candidate.T_view_model, options));
    }
  }
  count(state, "poses", bench.candidates.size());
}

void rank_candidates(State& state, const Bench& bench) {
  const Model* const models[] = {&bench.model};
  const VerifyOptions verification[] = {final_verification(bench.map, bench.model)};
  const RankOptions options = {
      .verification = verification, .min_score = bench.params.min_score, .presence_score = bench.params.presence_score};
  for (auto _ : state) benchmark::DoNotOptimize(rank(bench.map, models, bench.candidates, options));
  count(state, "poses", bench.candidates.size());
}

void detect_parts(State& state, const Bench& bench) {
  const Model* const models[] = {&bench.model};
  const RunControl control = {.threads = static_cast<int>(state.range(0))};
  for (auto _ : state) benchmark::DoNotOptimize(detect(bench.cloud, models, bench.params, control));
  count(state, "points", bench.view.points.size());
}

/// @param bench  outlives the benchmarks' runs.
void add_all(const Bench& bench) {
  const auto add = [&bench](const char* name, void (*stage)(State&, const Bench&)) {
    return benchmark::RegisterBenchmark(name, [&bench, stage](State& state) { stage(state, bench); })
        ->Unit(benchmark::kMillisecond);
  };
  add("train", train_part);
  add("sensor_view", view_cloud);
  add("depth_map", map_depth);
  add("normals/radius", find_normals)->Arg(1)->Arg(3);
  add("contours", find_outlines);
  add("vote", vote_by_surface);
  add("contour_votes", vote_by_contour);
  add("cluster", cluster_votes);
  add("refine", refine_candidates);
  add("verify", verify_candidates);
  add("rank", rank_candidates);
  add("detect/threads", detect_parts)->Arg(1)->Arg(2)->UseRealTime();
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const std::string parts = argc > 2 ? argv[1] : "tests/data/parts";
  const std::string scene = argc > 2 ? argv[2] : "tests/data/scenes/bearing_support_01";
  const Bench bench = make_bench(parts, scene);
  add_all(bench);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}

/// How long a cancelled detection or training goes on: cancels at moments all along its course.
///
///   binpose-bench-cancels PARTS SCENE... [--repeat N] [--train]
#include <pthread.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "core/detect/detect.h"
#include "core/train/train.h"
#include "tests/support/bin_scene.h"

namespace {

using namespace binpose;           // NOLINT
using namespace binpose::testing;  // NOLINT
using Clock = std::chrono::steady_clock;

double milliseconds(Clock::duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

/// Time that a thread has computed, so that other work on the machine does not count; ms.
double milliseconds_of(clockid_t thread_clock) {
  timespec time{};
  clock_gettime(thread_clock, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// The cloud as of a sensor of finer resolution: each point `count` times, shaken by about the points' distance.
void repeat(PointCloud& cloud, int count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> shake(-5e-4F, 5e-4F);
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3f& p : cloud.points) {
    for (int i = 0; i < count; ++i) points.push_back(p + Eigen::Vector3f(shake(random), shake(random), 0));
  }
  cloud.points = std::move(points);
  cloud.width = static_cast<std::uint32_t>(cloud.points.size());
  cloud.height = 1;
}

/// Cancels the work at evenly spread moments of its course, and prints how long it went on computing.
void cancel_all_along(const std::string& name, int count, const std::function<void(const RunControl&)>& work) {
  const Clock::time_point first = Clock::now();
  work({});
  const Clock::duration whole = Clock::now() - first;
  clockid_t worker{};
  pthread_getcpuclockid(pthread_self(), &worker);
  std::vector<std::pair<double, double>> lags;  // length and moment, ms
  for (int i = 0; i < count; ++i) {
    const Clock::duration moment = whole * i / count;
    double cancel = 0;
    std::atomic<bool> ended = false;
    std::stop_source stop;
    const Clock::time_point start = Clock::now();
    std::jthread canceller([&] {
      std::this_thread::sleep_until(start + moment);
      if (ended) return;
      cancel = milliseconds_of(worker);
      stop.request_stop();
    });
    work({.stop = stop.get_token()});
    const double end = milliseconds_of(worker);
    ended = true;
    canceller.join();
    if (stop.stop_requested()) lags.emplace_back(std::max(0.0, end - cancel), milliseconds(moment));
  }
  std::sort(lags.rbegin(), lags.rend());
  const auto late = std::count_if(lags.begin(), lags.end(), [](const auto& lag) { return lag.first > 10; });
  std::printf("%-24s %.0f ms: of %zu cancels %td ended after more than 10 ms; longest:", name.c_str(),
              milliseconds(whole), lags.size(), late);
  for (std::size_t i = 0; i < std::min<std::size_t>(6, lags.size()); ++i) {
    std::printf(" %.1f (at %.0f)", lags[i].first, lags[i].second);
  }
  std::printf(" ms\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Cancels detections and trainings all along their course.");
  std::string parts_folder;
  int repetitions = 1, count = 100;
  std::vector<std::string> scenes;
  bool trainings = false;
  app.add_option("parts", parts_folder)->required();
  app.add_option("scenes", scenes, "scene folders")->required();
  app.add_option("--cancels", count, "of each work");
  app.add_option("--repeat", repetitions, "points for each of the scan's");
  app.add_flag("--train", trainings, "cancel the training of each part too");
  CLI11_PARSE(app, argc, argv);

  const std::vector<ScenePart> parts = read_parts(parts_folder);
  for (const std::string& folder : scenes) {
    BinScene scene = read_scene(folder);
    repeat(scene.cloud, repetitions);
    const auto part =
        std::find_if(parts.begin(), parts.end(), [&](const ScenePart& p) { return p.name == scene.part; });
    if (part == parts.end()) continue;
    if (trainings) {
      cancel_all_along(part->name + " training", count,
                       [&](const RunControl& control) { static_cast<void>(train(part->mesh, {}, control)); });
    }
    const absl::StatusOr<Model> model = train(part->mesh, {}, {});
    if (!model.ok()) return 1;
    const Model* const models[] = {&*model};
    cancel_all_along(scene.name, count,
                     [&](const RunControl& control) { static_cast<void>(detect(scene.cloud, models, {}, control)); });
  }
}

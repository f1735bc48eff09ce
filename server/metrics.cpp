#include "server/metrics.h"

namespace binpose::server {
namespace {

constexpr std::array kMethodNames = {"Train", "GetModel", "GetModelShape", "ListModels", "DeleteModel", "Detect"};
constexpr std::array kStageNames = {"preprocess", "vote", "cluster", "refine", "verify", "rank"};

/// From a fast detection to a slow training, seconds.
prometheus::Histogram::BucketBoundaries duration_buckets() {
  return {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30};
}

prometheus::Family<prometheus::Histogram>& durations(prometheus::Registry& registry, const char* name,
                                                     const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

prometheus::Gauge& gauge(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
}

}  // namespace

Metrics::Metrics()
    : queue_seconds_(durations(*registry_, "binpose_detect_queue_duration_seconds",
                               "Time between a frame's arrival and the start of its computation.")
                         .Add({}, duration_buckets())),
      models_(gauge(*registry_, "binpose_models_loaded", "Models that are served.")),
      streams_(gauge(*registry_, "binpose_detect_streams", "Detect streams that are open.")),
      skipped_model_files_(prometheus::BuildCounter()
                               .Name("binpose_model_files_skipped_total")
                               .Help("Files in the model directory that could not be used.")
                               .Register(*registry_)
                               .Add({})) {
  static_assert(kMethodNames.size() == kMethods && kStageNames.size() == kStages);
  auto& requests = prometheus::BuildCounter()
                       .Name("binpose_requests_total")
                       .Help("Calls that have ended, and answered frames of Detect streams, by status code.")
                       .Register(*registry_);
  auto& request_seconds =
      durations(*registry_, "binpose_request_duration_seconds", "Time from a request's arrival to its answer.");
  for (int method = 0; method < kMethods; ++method) {
    for (int code = 0; code < kCodes; ++code) {
      requests_[method][code] = &requests.Add(
          {{"method", kMethodNames[method]}, {"code", absl::StatusCodeToString(static_cast<absl::StatusCode>(code))}});
    }
    request_seconds_[method] = &request_seconds.Add({{"method", kMethodNames[method]}}, duration_buckets());
  }
  auto& stage_seconds =
      durations(*registry_, "binpose_detect_stage_duration_seconds", "Compute time of a detection by stage.");
  for (int stage = 0; stage < kStages; ++stage) {
    stage_seconds_[stage] = &stage_seconds.Add({{"stage", kStageNames[stage]}}, duration_buckets());
  }
}

void Metrics::count_request(Method method, absl::StatusCode code, double seconds) {
  const int index = static_cast<int>(method);
  const int code_index = static_cast<int>(code);
  requests_[index][code_index < kCodes ? code_index : static_cast<int>(absl::StatusCode::kUnknown)]->Increment();
  request_seconds_[index]->Observe(seconds);
}

void Metrics::observe_detection(const v1::DetectStats& stats) {
  const std::array<double, kStages> stages = {stats.preprocess_seconds(), stats.vote_seconds(),
                                              stats.cluster_seconds(),    stats.refine_seconds(),
                                              stats.verify_seconds(),     stats.rank_seconds()};
  for (int stage = 0; stage < kStages; ++stage) stage_seconds_[stage]->Observe(stages[stage]);
  queue_seconds_.Observe(stats.queue_seconds());
}

}  // namespace binpose::server

#include "server/metrics.h"

#include "server/refusal.h"

namespace binpose::server {
namespace {

constexpr std::array kMethodNames = {"Train",       "GetModel",    "GetModelShape", "ListModels",
                                     "DeleteModel", "ExportModel", "ImportModel",   "Detect"};
constexpr std::array kRefusalNames = {"queue_full", "deadline", "memory"};
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

prometheus::Gauge& waiting(prometheus::Registry& registry, const char* lane) {
  return prometheus::BuildGauge()
      .Name("binpose_queue_length")
      .Help("Work that waits for a thread.")
      .Register(registry)
      .Add({{"lane", lane}});
}

prometheus::Histogram& cancels(prometheus::Registry& registry, const char* place) {
  return durations(registry, "binpose_cancel_duration_seconds",
                   "Time from a caller's cancel to the end of its work, by where the cancel caught it.")
      .Add({{"place", place}}, duration_buckets());
}

prometheus::Counter& counter(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
}

/// Counts up to what was counted elsewhere.
void advance_to(prometheus::Counter& counter, std::size_t count) {
  counter.Increment(std::max(0.0, static_cast<double>(count) - counter.Value()));
}

}  // namespace

Metrics::Metrics()
    : queue_seconds_(durations(*registry_, "binpose_detect_queue_duration_seconds",
                               "Time between a frame's arrival and the start of its computation.")
                         .Add({}, duration_buckets())),
      train_seconds_(durations(*registry_, "binpose_train_duration_seconds",
                               "Time of trainings that ended well, from their start to the saved model.")
                         .Add({}, prometheus::Histogram::BucketBoundaries{0.5, 1, 2.5, 5, 10, 30, 60, 120, 300})),
      queue_cancel_seconds_(cancels(*registry_, "queue")),
      compute_cancel_seconds_(cancels(*registry_, "compute")),
      training_cancel_seconds_(cancels(*registry_, "training")),
      points_(counter(*registry_, "binpose_detect_points_total", "Measured points in searched clouds.")),
      hypotheses_(counter(*registry_, "binpose_detect_hypotheses_total", "Hypotheses that were answered.")),
      models_served_(gauge(*registry_, "binpose_models_served", "Models that are served.")),
      models_loaded_(gauge(*registry_, "binpose_models_loaded", "Models that are in memory.")),
      model_bytes_(gauge(*registry_, "binpose_models_bytes", "Bytes of memory that models take.")),
      model_loads_(counter(*registry_, "binpose_model_loads_total",
                           "Times that a model was wanted that had left memory for others.")),
      model_directory_age_(
          gauge(*registry_, "binpose_model_directory_age_seconds", "Seconds since the model directory was last read.")),
      waiting_detections_(waiting(*registry_, "detections")),
      waiting_trainings_(waiting(*registry_, "trainings")),
      request_bytes_(gauge(*registry_, "binpose_requests_held_bytes", "Bytes of requests that wait or are computed.")),
      resident_bytes_(gauge(*registry_, "process_resident_memory_bytes", "Resident memory of the process.")),
      streams_(gauge(*registry_, "binpose_detect_streams", "Detect streams that are open.")),
      skipped_model_files_(counter(*registry_, "binpose_model_files_skipped_total",
                                   "Times that a file in the model directory could not be used.")),
      model_searches_(prometheus::BuildCounter()
                          .Name("binpose_model_searches_total")
                          .Help("Clouds that were searched for a model.")
                          .Register(*registry_)),
      model_found_(prometheus::BuildCounter()
                       .Name("binpose_model_hypotheses_total")
                       .Help("Hypotheses of a model that were answered.")
                       .Register(*registry_)) {
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
  auto& refusals = prometheus::BuildCounter()
                       .Name("binpose_refusals_total")
                       .Help("Requests that were refused because the server was full, by what was full.")
                       .Register(*registry_);
  for (std::size_t i = 0; i < kRefusalNames.size(); ++i) refusals_[i] = &refusals.Add({{"reason", kRefusalNames[i]}});
  prometheus::BuildGauge()
      .Name("binpose_build_info")
      .Help("Always 1; what runs is in the labels.")
      .Register(*registry_)
      .Add({{"version", BINPOSE_VERSION}})
      .Set(1);
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

void Metrics::count_search(const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                           const v1::DetectResponse& response) {
  const std::lock_guard lock(mutex_);
  for (const std::string& id : model_ids) {
    const auto [entry, is_new] = model_series_.try_emplace(id);
    if (is_new) entry->second = {&model_searches_.Add({{"model", id}}), &model_found_.Add({{"model", id}})};
    entry->second.searches->Increment();
  }
  for (const v1::PoseHypothesis& hypothesis : response.hypotheses()) {
    model_series_.at(hypothesis.model_id()).found->Increment();
  }
}

void Metrics::set_models(const ModelCache::Usage& usage) {
  models_served_.Set(static_cast<double>(usage.models));
  models_loaded_.Set(static_cast<double>(usage.in_memory));
  model_bytes_.Set(static_cast<double>(usage.bytes));
  advance_to(model_loads_, usage.loads);
}

void Metrics::set_skipped_model_files(std::size_t files) { advance_to(skipped_model_files_, files); }

void Metrics::keep_models(const std::set<std::string>& ids) {
  const std::lock_guard lock(mutex_);
  std::erase_if(model_series_, [&](const auto& entry) {
    if (ids.contains(entry.first)) return false;
    model_searches_.Remove(entry.second.searches);
    model_found_.Remove(entry.second.found);
    return true;
  });
}

void Metrics::count_refusal(const absl::Status& status) {
  if (const auto reason = refusal_of(status)) refusals_[static_cast<std::size_t>(*reason)]->Increment();
}

void Metrics::observe_cancel(std::string_view place, double seconds) {
  prometheus::Histogram& histogram = place == "queue"     ? queue_cancel_seconds_
                                     : place == "compute" ? compute_cancel_seconds_
                                                          : training_cancel_seconds_;
  histogram.Observe(seconds);
}

void Metrics::observe_detection(const v1::DetectStats& stats, std::size_t hypotheses) {
  points_.Increment(static_cast<double>(stats.point_count()));
  hypotheses_.Increment(static_cast<double>(hypotheses));
  const std::array<double, kStages> stages = {stats.preprocess_seconds(), stats.vote_seconds(),
                                              stats.cluster_seconds(),    stats.refine_seconds(),
                                              stats.verify_seconds(),     stats.rank_seconds()};
  for (int stage = 0; stage < kStages; ++stage) stage_seconds_[stage]->Observe(stages[stage]);
  queue_seconds_.Observe(stats.queue_seconds());
}

}  // namespace binpose::server

#pragma once

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "binpose/v1/detection_service.pb.h"
#include "server/model_cache.h"

namespace binpose::server {

/// The methods that are measured.
enum class Method { kTrain, kGetModel, kGetModelShape, kListModels, kDeleteModel, kExportModel, kImportModel, kDetect };

/// What the server tells about itself at /metrics. Thread-safe; only the series of models are looked up by name after
/// construction.
class Metrics {
 public:
  Metrics();

  /// Counts a call that has ended, or a frame of a Detect stream that is answered.
  void count_request(Method method, absl::StatusCode code, double seconds);
  /// Notes where a detection spent its time.
  void observe_detection(const v1::DetectStats& stats, std::size_t hypotheses);
  /// Counts for each of the models that it was searched for, and what was found of it.
  void count_search(const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                    const v1::DetectResponse& response);
  /// Notes how many models there are and what they take.
  void set_models(const ModelCache::Usage& usage);
  void set_skipped_model_files(std::size_t files);
  /// Drops the series of all models but these.
  void keep_models(const std::set<std::string>& ids);
  /// Notes a training that ended well; without the time that it waited.
  void observe_training(double seconds) { train_seconds_.Observe(seconds); }
  /// Notes a request that was refused; does nothing unless refused() made `status`.
  void count_refusal(const absl::Status& status);
  /// Notes how long after its cancel a request ended, and whether in "queue", "compute" or "training".
  void observe_cancel(std::string_view place, double seconds);

  prometheus::Gauge& model_directory_age() { return model_directory_age_; }
  prometheus::Gauge& waiting_detections() { return waiting_detections_; }
  prometheus::Gauge& waiting_trainings() { return waiting_trainings_; }
  prometheus::Gauge& request_bytes() { return request_bytes_; }
  prometheus::Gauge& resident_bytes() { return resident_bytes_; }
  prometheus::Gauge& streams() { return streams_; }
  std::shared_ptr<prometheus::Registry> registry() const { return registry_; }

 private:
  static constexpr int kMethods = 8;
  static constexpr int kCodes = 17;
  static constexpr int kStages = 6;

  std::shared_ptr<prometheus::Registry> registry_ = std::make_shared<prometheus::Registry>();
  std::array<std::array<prometheus::Counter*, kCodes>, kMethods> requests_;
  std::array<prometheus::Histogram*, kMethods> request_seconds_;
  std::array<prometheus::Histogram*, kStages> stage_seconds_;
  prometheus::Histogram& queue_seconds_;
  prometheus::Histogram& train_seconds_;
  std::array<prometheus::Counter*, 3> refusals_;
  prometheus::Histogram& queue_cancel_seconds_;
  prometheus::Histogram& compute_cancel_seconds_;
  prometheus::Histogram& training_cancel_seconds_;
  prometheus::Counter& points_;
  prometheus::Counter& hypotheses_;
  prometheus::Gauge& models_served_;
  prometheus::Gauge& models_loaded_;
  prometheus::Gauge& model_bytes_;
  prometheus::Counter& model_loads_;
  prometheus::Gauge& model_directory_age_;
  prometheus::Gauge& waiting_detections_;
  prometheus::Gauge& waiting_trainings_;
  prometheus::Gauge& request_bytes_;
  prometheus::Gauge& resident_bytes_;
  prometheus::Gauge& streams_;
  prometheus::Counter& skipped_model_files_;

  struct ModelSeries {
    prometheus::Counter* searches;
    prometheus::Counter* found;
  };
  prometheus::Family<prometheus::Counter>& model_searches_;
  prometheus::Family<prometheus::Counter>& model_found_;
  std::mutex mutex_;  ///< guards what follows
  std::map<std::string, ModelSeries> model_series_;
};

}  // namespace binpose::server

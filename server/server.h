#pragma once

#include <grpcpp/server.h>

#include <atomic>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/backend.h"
#include "server/config.h"
#include "server/detection_service.h"
#include "server/metrics_endpoint.h"
#include "server/model_service.h"

namespace binpose::server {

/// The running server: owns all that lives as long as it does.
class Server {
 public:
  /// Loads the models, then serves. Errors, naming the address or directory: UNAVAILABLE, INTERNAL.
  static absl::StatusOr<std::unique_ptr<Server>> start(const Config& config);
  /// Stops if stop() was not called.
  ~Server();

  /// HOST:PORT that is served, with the port chosen.
  const std::string& address() const { return address_; }
  /// The same of GET /metrics; empty if it is not served.
  const std::string& metrics_address() const { return metrics_address_; }

  /// Health says NOT_SERVING; after the drain delay no more calls are taken; what runs is finished, up to the drain
  /// timeout; the rest is cancelled.
  void stop();

  /// Whether the model directory does not answer: the destructor would wait for it.
  bool waits_for_directory() const;

 private:
  explicit Server(const Config& config);
  absl::Status serve_metrics();
  absl::Status load();
  absl::Status listen();
  std::string directory_detail() const;
  void update_metrics();

  const Config config_;
  Metrics metrics_;
  Drain drain_;
  WriteWatch writes_;
  MemoryBudget requests_;
  Tokens tokens_;
  std::unique_ptr<ModelStore> models_;
  ComputePool detections_;
  ComputePool trainings_;
  std::unique_ptr<ModelService> model_service_;
  std::unique_ptr<DetectionService> detection_service_;
  std::atomic<bool> is_ready_ = false;
  std::unique_ptr<MetricsEndpoint> metrics_endpoint_;
  std::unique_ptr<grpc::Server> grpc_server_;
  std::string address_;
  std::string metrics_address_;
};

}  // namespace binpose::server

#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "binpose/v1/detection_service.grpc.pb.h"
#include "binpose/v1/model_service.grpc.pb.h"
#include "server/server.h"
#include "tests/server/temporary_directory.h"

namespace binpose::server {

/// A free port and the directory given, no metrics (their HTTP server takes two seconds to end), all else as by
/// default.
Config test_config(const std::filesystem::path& model_dir);

/// A server in this process with stubs on a real connection to it.
class RunningServer {
 public:
  RunningServer() { start(test_config(directory_.path())); }
  explicit RunningServer(const std::filesystem::path& model_dir) { start(test_config(model_dir)); }
  explicit RunningServer(const Config& config) { start(config); }

  Server& server() { return *server_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  v1::ModelService::Stub& models() { return *models_; }
  v1::DetectionService::Stub& detections() { return *detections_; }

  /// Trains and returns how the call ended; fills `messages` if given.
  grpc::Status train(const v1::TrainRequest& request, std::vector<v1::TrainResponse>* messages = nullptr);
  /// The answers to all requests over one stream, which must end well.
  std::vector<v1::DetectResponse> detect(const std::vector<v1::DetectRequest>& requests);

 private:
  void start(const Config& config);

  TemporaryDirectory directory_;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::ModelService::Stub> models_;
  std::unique_ptr<v1::DetectionService::Stub> detections_;
};

}  // namespace binpose::server

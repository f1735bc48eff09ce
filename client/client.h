#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "binpose/v1/detection_service.grpc.pb.h"
#include "binpose/v1/model_service.grpc.pb.h"
#include "client/detect_stream.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace binpose::client {

/// How long to wait for a server.
struct Timeouts {
  std::chrono::milliseconds call = std::chrono::seconds(10);      ///< a short call: to get, list or delete models
  std::chrono::milliseconds training = std::chrono::minutes(10);  ///< a whole training
  std::chrono::milliseconds answer = std::chrono::minutes(1);     ///< the next answer on a stream of frames
};

/// How to reach a server.
struct Connection {
  std::string server;         ///< HOST:PORT
  std::string tls_ca = {};    ///< PEM text of the authorities that vouch for the server; empty = plaintext
  std::string tls_cert = {};  ///< PEM text of the certificate that the server asks for; empty = none
  std::string tls_key = {};   ///< PEM text of its key
  std::string token = {};     ///< bearer token; empty = none. In plaintext everybody on the way can read it.
};

/// Told what a training does; see TrainResponse.
using TrainObserver = std::function<void(const v1::TrainResponse& progress)>;

/// A connection to a binpose server. Thread-safe; make one and keep it.
///
/// Every error is a sentence that says what failed, where, and what to do next; its code is that of the gRPC call.
class Client {
 public:
  /// Connects with the first call, and again when the connection is lost.
  explicit Client(const Connection& connection, Timeouts timeouts = {});
  /// `server`: HOST:PORT, plaintext.
  explicit Client(const std::string& server, Timeouts timeouts = {}) : Client(Connection{.server = server}, timeouts) {}

  /// OK when the server takes calls; UNAVAILABLE when it does not, for example because it is about to end.
  absl::Status check_health();

  /// Trains a model and waits until it is served. `observer` is called on this thread, for every message of progress.
  absl::StatusOr<v1::Model> train(const v1::TrainRequest& request, const TrainObserver& observer = {});

  absl::StatusOr<v1::Model> get_model(const std::string& id);
  absl::StatusOr<v1::GetModelShapeResponse> get_model_shape(const std::string& id);
  absl::StatusOr<v1::ListModelsResponse> list_models();
  absl::Status delete_model(const std::string& id);
  /// The bytes of a model, for import_model() of another server.
  absl::StatusOr<std::string> export_model(const std::string& id);
  absl::StatusOr<v1::Model> import_model(const std::string& id, const std::string& bytes);

  /// Searches one scan. An answer that carries an `error` becomes that error.
  absl::StatusOr<v1::DetectResponse> detect(const v1::DetectRequest& request);

  /// Opens a stream for any number of scans. It may outlive the client.
  std::unique_ptr<DetectStream> open_detect_stream();

 private:
  std::string server_;
  Timeouts timeouts_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<grpc::health::v1::Health::Stub> health_;
  std::unique_ptr<v1::ModelService::Stub> models_;
  std::unique_ptr<v1::DetectionService::Stub> detection_;
};

}  // namespace binpose::client

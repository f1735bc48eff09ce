#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "binpose/v1/model_service.grpc.pb.h"
#include "client/connection.h"
#include "client/detect_stream.h"
#include "client/servers.h"

namespace binpose::client {

/// Told what a training does; see TrainResponse.
using TrainObserver = std::function<void(const v1::TrainResponse& progress)>;

/// A connection to a binpose server. Thread-safe; make one and keep it.
///
/// Where a connection names several servers, a call goes to the next when one cannot be reached: so a training whose
/// server was lost may give two generations, and a deletion may find its model deleted.
///
/// Every error is a sentence that says what failed, where, and what to do next; its code is that of the gRPC call.
class Client {
 public:
  /// Connects with the first call, and again when the connection is lost.
  explicit Client(const Connection& connection, Timeouts timeouts = {}, Retries retries = {});
  /// `server`: as in Connection; plaintext.
  explicit Client(const std::string& server, Timeouts timeouts = {}, Retries retries = {})
      : Client(Connection{.server = server}, timeouts, retries) {}

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
  absl::StatusOr<v1::DetectResponse> detect(Scan scan);
  absl::StatusOr<v1::DetectResponse> detect(v1::DetectRequest request) {
    return detect(std::make_shared<const v1::DetectRequest>(std::move(request)));
  }

  /// Opens a stream for any number of scans. It may outlive the client.
  std::unique_ptr<DetectStream> open_detect_stream();

 private:
  template <class Call>
  absl::Status call(const std::string& what, const std::string& model_id, std::chrono::milliseconds timeout, Call call);

  std::shared_ptr<Servers> servers_;
  Timeouts timeouts_;
  Retries retries_;
};

}  // namespace binpose::client

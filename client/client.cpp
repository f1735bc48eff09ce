#include "client/client.h"

#include <optional>
#include <utility>

#include "client/call_error.h"

namespace binpose::client {
namespace {

void send_pieces(const std::string& id, const std::string& bytes, grpc::ClientWriter<v1::ImportModelRequest>& stream) {
  constexpr std::size_t kPieceBytes = std::size_t{1} << 20;
  v1::ImportModelRequest part;
  part.set_id(id);
  std::size_t sent = 0;
  do {
    part.set_data(bytes.substr(sent, kPieceBytes));
    sent += part.data().size();
  } while (stream.Write(part) && sent < bytes.size());
  stream.WritesDone();
}

}  // namespace

Client::Client(const Connection& connection, Timeouts timeouts, Retries retries)
    : servers_(std::make_shared<Servers>(connection)), timeouts_(timeouts), retries_(retries) {}

template <class Call>
absl::Status Client::call(const std::string& what, const std::string& model_id, std::chrono::milliseconds timeout,
                          Call call) {
  const auto deadline = std::chrono::system_clock::now() + timeout;
  grpc::Status status;
  for (std::size_t tried = 0; tried < (retries_.attempts > 0 ? servers_->count() : 1); ++tried) {
    const Stubs& server = servers_->current();
    grpc::ClientContext context;
    context.set_deadline(deadline);
    set_routing_key(model_id, context);
    status = call(server, context);
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE) break;
    servers_->leave(server);
  }
  return call_error(status, {what, servers_->name()});
}

absl::Status Client::check_health() {
  grpc::health::v1::HealthCheckResponse response;
  absl::Status status =
      call("Asking for health", "", timeouts_.call, [&](const Stubs& server, grpc::ClientContext& context) {
        return server.health->Check(&context, grpc::health::v1::HealthCheckRequest(), &response);
      });
  if (!status.ok() || response.status() == grpc::health::v1::HealthCheckResponse::SERVING) return status;
  return absl::UnavailableError("The server at " + servers_->name() +
                                " answers, but takes no calls: it starts or ends.");
}

absl::StatusOr<v1::Model> Client::train(const v1::TrainRequest& request, const TrainObserver& observer) {
  const std::string what = "Training model \"" + request.id() + "\"";
  std::optional<v1::Model> model;
  absl::Status status =
      call(what, request.id(), timeouts_.training, [&](const Stubs& server, grpc::ClientContext& context) {
        const auto stream = server.models->Train(&context, request);
        v1::TrainResponse progress;
        while (stream->Read(&progress)) {
          if (observer) observer(progress);
          if (progress.has_model()) model = progress.model();
        }
        return stream->Finish();
      });
  if (!status.ok()) return status;
  if (!model) return absl::InternalError(what + " failed: the server at " + servers_->name() + " sent no model.");
  return *std::move(model);
}

absl::StatusOr<v1::Model> Client::get_model(const std::string& id) {
  v1::GetModelRequest request;
  request.set_id(id);
  v1::Model model;
  absl::Status status =
      call("Reading model \"" + id + "\"", id, timeouts_.call, [&](const Stubs& server, grpc::ClientContext& context) {
        return server.models->GetModel(&context, request, &model);
      });
  if (!status.ok()) return status;
  return model;
}

absl::StatusOr<v1::GetModelShapeResponse> Client::get_model_shape(const std::string& id) {
  v1::GetModelShapeRequest request;
  request.set_id(id);
  v1::GetModelShapeResponse shape;
  absl::Status status = call("Reading the shape of model \"" + id + "\"", id, timeouts_.call,
                             [&](const Stubs& server, grpc::ClientContext& context) {
                               return server.models->GetModelShape(&context, request, &shape);
                             });
  if (!status.ok()) return status;
  return shape;
}

absl::StatusOr<v1::ListModelsResponse> Client::list_models() {
  v1::ListModelsResponse models;
  absl::Status status =
      call("Listing the models", "", timeouts_.call, [&](const Stubs& server, grpc::ClientContext& context) {
        return server.models->ListModels(&context, v1::ListModelsRequest(), &models);
      });
  if (!status.ok()) return status;
  return models;
}

absl::Status Client::delete_model(const std::string& id) {
  v1::DeleteModelRequest request;
  request.set_id(id);
  v1::DeleteModelResponse response;
  return call("Deleting model \"" + id + "\"", id, timeouts_.call,
              [&](const Stubs& server, grpc::ClientContext& context) {
                return server.models->DeleteModel(&context, request, &response);
              });
}

absl::StatusOr<std::string> Client::export_model(const std::string& id) {
  v1::ExportModelRequest request;
  request.set_id(id);
  std::string bytes;
  absl::Status status = call("Exporting model \"" + id + "\"", id, timeouts_.call,
                             [&](const Stubs& server, grpc::ClientContext& context) {
                               const auto stream = server.models->ExportModel(&context, request);
                               bytes.clear();
                               v1::ExportModelResponse part;
                               while (stream->Read(&part)) bytes += part.data();
                               return stream->Finish();
                             });
  if (!status.ok()) return status;
  return bytes;
}

absl::StatusOr<v1::Model> Client::import_model(const std::string& id, const std::string& bytes) {
  v1::ImportModelResponse response;
  absl::Status status = call("Importing model \"" + id + "\"", id, timeouts_.call,
                             [&](const Stubs& server, grpc::ClientContext& context) {
                               const auto stream = server.models->ImportModel(&context, &response);
                               send_pieces(id, bytes, *stream);
                               return stream->Finish();
                             });
  if (!status.ok()) return status;
  return response.model();
}

absl::StatusOr<v1::DetectResponse> Client::detect(Scan scan) {
  const std::unique_ptr<DetectStream> stream = open_detect_stream();
  if (absl::Status status = stream->write(std::move(scan)); !status.ok()) return status;
  stream->done_writing();
  std::optional<v1::DetectResponse> answer = stream->read();
  if (absl::Status status = stream->finish(); !status.ok()) return status;
  if (!answer.has_value()) {
    return absl::InternalError("The server at " + servers_->name() + " sent no answer to the scan.");
  }
  if (absl::Status status = frame_error(*answer); !status.ok()) return status;
  return *std::move(answer);
}

std::unique_ptr<DetectStream> Client::open_detect_stream() {
  return std::make_unique<DetectStream>(servers_, timeouts_.answer, retries_);
}

}  // namespace binpose::client

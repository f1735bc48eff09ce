#include "client/client.h"

#include <grpcpp/support/client_interceptor.h>

#include <utility>

#include "client/call_error.h"

namespace binpose::client {
namespace {

/// Puts a bearer token on every call. An interceptor, because gRPC's call credentials refuse plaintext.
class TokenInterceptor final : public grpc::experimental::Interceptor {
 public:
  explicit TokenInterceptor(const std::string& token) : header_("Bearer " + token) {}
  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA)) {
      methods->GetSendInitialMetadata()->emplace("authorization", header_);
    }
    methods->Proceed();
  }

 private:
  const std::string header_;
};

class TokenInterceptorFactory final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit TokenInterceptorFactory(std::string token) : token_(std::move(token)) {}
  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo* /*info*/) override {
    return new TokenInterceptor(token_);
  }

 private:
  const std::string token_;
};

std::shared_ptr<grpc::ChannelCredentials> credentials(const Connection& connection) {
  if (connection.tls_ca.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = connection.tls_ca;
  options.pem_cert_chain = connection.tls_cert;
  options.pem_private_key = connection.tls_key;
  return grpc::SslCredentials(options);
}

std::shared_ptr<grpc::Channel> open_channel(const Connection& connection) {
  grpc::ChannelArguments arguments;
  // The server states its own limits in its errors; gRPC's 4 MB would refuse answers here before anyone reads them.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // Notices a peer that vanished without a word. Servers take more than one ping in five minutes for abuse.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 310'000);
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  if (!connection.token.empty()) interceptors.push_back(std::make_unique<TokenInterceptorFactory>(connection.token));
  return grpc::experimental::CreateCustomChannelWithInterceptors(connection.server, credentials(connection), arguments,
                                                                 std::move(interceptors));
}

void set_timeout(std::chrono::milliseconds timeout, grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + timeout);
}

}  // namespace

Client::Client(const Connection& connection, Timeouts timeouts)
    : server_(connection.server),
      timeouts_(timeouts),
      channel_(open_channel(connection)),
      health_(grpc::health::v1::Health::NewStub(channel_)),
      models_(v1::ModelService::NewStub(channel_)),
      detection_(v1::DetectionService::NewStub(channel_)) {}

absl::Status Client::check_health() {
  const CallName call{"Asking for health", server_};
  grpc::ClientContext context;
  set_timeout(timeouts_.call, context);
  grpc::health::v1::HealthCheckResponse response;
  const grpc::Status status = health_->Check(&context, grpc::health::v1::HealthCheckRequest(), &response);
  if (!status.ok()) return call_error(status, call);
  if (response.status() == grpc::health::v1::HealthCheckResponse::SERVING) return absl::OkStatus();
  return absl::UnavailableError("The server at " + server_ + " answers, but takes no calls: it starts or ends.");
}

absl::StatusOr<v1::Model> Client::train(const v1::TrainRequest& request, const TrainObserver& observer) {
  const CallName call{"Training model \"" + request.id() + "\"", server_};
  grpc::ClientContext context;
  set_timeout(timeouts_.training, context);
  const auto stream = models_->Train(&context, request);
  v1::TrainResponse progress;
  v1::Model model;
  bool is_done = false;
  while (stream->Read(&progress)) {
    if (observer) observer(progress);
    if (!progress.has_model()) continue;
    model = progress.model();
    is_done = true;
  }
  if (absl::Status status = call_error(stream->Finish(), call); !status.ok()) return status;
  if (!is_done) return absl::InternalError(call.what + " failed: the server at " + server_ + " sent no model.");
  return model;
}

absl::StatusOr<v1::Model> Client::get_model(const std::string& id) {
  grpc::ClientContext context;
  set_timeout(timeouts_.call, context);
  v1::GetModelRequest request;
  request.set_id(id);
  v1::Model model;
  const grpc::Status status = models_->GetModel(&context, request, &model);
  if (!status.ok()) return call_error(status, {"Reading model \"" + id + "\"", server_});
  return model;
}

absl::StatusOr<v1::GetModelShapeResponse> Client::get_model_shape(const std::string& id) {
  grpc::ClientContext context;
  set_timeout(timeouts_.call, context);
  v1::GetModelShapeRequest request;
  request.set_id(id);
  v1::GetModelShapeResponse shape;
  const grpc::Status status = models_->GetModelShape(&context, request, &shape);
  if (!status.ok()) return call_error(status, {"Reading the shape of model \"" + id + "\"", server_});
  return shape;
}

absl::StatusOr<v1::ListModelsResponse> Client::list_models() {
  grpc::ClientContext context;
  set_timeout(timeouts_.call, context);
  v1::ListModelsResponse models;
  const grpc::Status status = models_->ListModels(&context, v1::ListModelsRequest(), &models);
  if (!status.ok()) return call_error(status, {"Listing the models", server_});
  return models;
}

absl::Status Client::delete_model(const std::string& id) {
  grpc::ClientContext context;
  set_timeout(timeouts_.call, context);
  v1::DeleteModelRequest request;
  request.set_id(id);
  v1::DeleteModelResponse response;
  return call_error(models_->DeleteModel(&context, request, &response), {"Deleting model \"" + id + "\"", server_});
}

absl::StatusOr<std::string> Client::export_model(const std::string& id) {
  grpc::ClientContext context;
  set_timeout(timeouts_.call, context);
  v1::ExportModelRequest request;
  request.set_id(id);
  const auto stream = models_->ExportModel(&context, request);
  std::string bytes;
  v1::ExportModelResponse part;
  while (stream->Read(&part)) bytes += part.data();
  const grpc::Status status = stream->Finish();
  if (!status.ok()) return call_error(status, {"Exporting model \"" + id + "\"", server_});
  return bytes;
}

absl::StatusOr<v1::Model> Client::import_model(const std::string& id, const std::string& bytes) {
  constexpr std::size_t kPieceBytes = std::size_t{1} << 20;
  grpc::ClientContext context;
  set_timeout(timeouts_.call, context);
  v1::ImportModelResponse response;
  const auto stream = models_->ImportModel(&context, &response);
  v1::ImportModelRequest part;
  part.set_id(id);
  std::size_t sent = 0;
  do {
    part.set_data(bytes.substr(sent, kPieceBytes));
    sent += part.data().size();
  } while (stream->Write(part) && sent < bytes.size());
  stream->WritesDone();
  const grpc::Status status = stream->Finish();
  if (!status.ok()) return call_error(status, {"Importing model \"" + id + "\"", server_});
  return response.model();
}

absl::StatusOr<v1::DetectResponse> Client::detect(const v1::DetectRequest& request) {
  const std::unique_ptr<DetectStream> stream = open_detect_stream();
  if (absl::Status status = stream->write(request); !status.ok()) return status;
  stream->done_writing();
  std::optional<v1::DetectResponse> answer = stream->read();
  if (absl::Status status = stream->finish(); !status.ok()) return status;
  if (!answer.has_value()) return absl::InternalError("The server at " + server_ + " sent no answer to the scan.");
  if (absl::Status status = frame_error(*answer); !status.ok()) return status;
  return *std::move(answer);
}

std::unique_ptr<DetectStream> Client::open_detect_stream() {
  return std::make_unique<DetectStream>(*detection_, server_, timeouts_.answer);
}

}  // namespace binpose::client

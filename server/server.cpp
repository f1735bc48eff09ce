#include "server/server.h"

#include <google/protobuf/generated_message_reflection.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "grpc/health/v1/health.pb.h"

namespace binpose::server {
namespace {

/// Trainings that may wait; each holds a mesh.
constexpr std::size_t kTrainingQueue = 8;

/// HOST:PORT with the port replaced.
std::string with_port(const std::string& address, int port) {
  return absl::StrCat(address.substr(0, address.rfind(':') + 1), port);
}

/// Switches on, for servers built from now on, what tools expect of every gRPC server.
void enable_standard_services() {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  // gRPC serves health without its descriptor; this keeps ours in the program, so that reflection can describe it.
  google::protobuf::LinkMessageReflection<grpc::health::v1::HealthCheckRequest>();
}

}  // namespace

absl::StatusOr<std::unique_ptr<Server>> Server::start(const Config& config) {
  absl::StatusOr<std::unique_ptr<ModelStore>> models = ModelStore::open(config.model_dir);
  if (!models.ok()) return models.status();
  std::unique_ptr<Server> server(new Server(config, *std::move(models)));
  if (absl::Status status = server->serve_metrics(); !status.ok()) return status;
  if (absl::Status status = server->listen(); !status.ok()) return status;
  spdlog::info("serving {} models from {} on {}", server->models_->size(), config.model_dir.string(),
               server->address());
  return server;
}

Server::Server(const Config& config, std::unique_ptr<ModelStore> models)
    : config_(config),
      models_(std::move(models)),
      detections_("detections", config.threads, static_cast<std::size_t>(config.queue)),
      trainings_("trainings", 1, kTrainingQueue),
      model_service_({*models_, detections_, trainings_, metrics_, drain_}),
      detection_service_({*models_, detections_, trainings_, metrics_, drain_}) {
  metrics_.models().Set(static_cast<double>(models_->size()));
  metrics_.skipped_model_files().Increment(static_cast<double>(models_->skipped_files()));
}

Server::~Server() { stop(); }

absl::Status Server::serve_metrics() {
  if (config_.metrics.empty()) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<MetricsEndpoint>> endpoint =
      MetricsEndpoint::start(config_.metrics, metrics_.registry());
  if (!endpoint.ok()) return endpoint.status();
  metrics_endpoint_ = *std::move(endpoint);
  metrics_address_ = with_port(config_.metrics, metrics_endpoint_->port());
  return absl::OkStatus();
}

absl::Status Server::listen() {
  enable_standard_services();
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(config_.listen, grpc::InsecureServerCredentials(), &port);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);  // two servers on one port would share its calls
  builder.SetMaxReceiveMessageSize(config_.max_message_mib << 20);
  builder.RegisterService(&model_service_);
  builder.RegisterService(&detection_service_);
  grpc_server_ = builder.BuildAndStart();
  if (grpc_server_ == nullptr || port == 0) {
    return absl::UnavailableError(
        absl::StrFormat("Cannot listen on %s: is the address right and free?", config_.listen));
  }
  address_ = with_port(config_.listen, port);
  for (const char* service : {v1::ModelService::service_full_name(), v1::DetectionService::service_full_name()}) {
    grpc_server_->GetHealthCheckService()->SetServingStatus(service, true);
  }
  return absl::OkStatus();
}

void Server::stop() {
  if (grpc_server_ == nullptr) return;
  grpc_server_->GetHealthCheckService()->SetServingStatus(false);
  drain_.start();
  if (!drain_.wait_for_calls(std::chrono::seconds(config_.drain_timeout_seconds))) {
    spdlog::warn("calls still run after {} s; they are cancelled", config_.drain_timeout_seconds);
  }
  grpc_server_->Shutdown(std::chrono::system_clock::now());
  grpc_server_.reset();
}

}  // namespace binpose::server

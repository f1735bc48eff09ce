#include "server/server.h"

#include <google/protobuf/generated_message_reflection.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <limits>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "grpc/health/v1/health.pb.h"
#include "server/tls.h"

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

/// Bounds what gRPC holds: the messages in requests_ and two on their way.
void limit_memory(const Config& config, grpc::ServerBuilder& builder) {
  const std::size_t largest = static_cast<std::size_t>(config.max_message_mib) << 20;
  const std::size_t held = static_cast<std::size_t>(config.request_memory_mib) << 20;
  const std::size_t quota = held + 2 * largest;  // above it gRPC stops reading, then drops calls
  builder.SetResourceQuota(grpc::ResourceQuota("binpose").Resize(quota));
  // Above the limit, for requests_ says better than gRPC why a message is refused; but decoded it takes as much again.
  const std::size_t most = std::min({2 * largest, quota / 2, std::size_t{std::numeric_limits<int>::max()}});
  builder.SetMaxReceiveMessageSize(static_cast<int>(most));
}

/// Asks a silent peer whether it is there, so that the calls of one that vanished end within a minute.
void reap_dead_peers(grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
}

/// 0 where the system does not tell.
double resident_bytes() {
  double total_pages = 0;
  double resident_pages = 0;
  std::ifstream("/proc/self/statm") >> total_pages >> resident_pages;
  return resident_pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Server>> Server::start(const Config& config) {
  if (absl::Status status = check(config); !status.ok()) return status;
  std::unique_ptr<Server> server(new Server(config));
  // Metrics first, so that it can be seen that the server lives and is not ready.
  if (absl::Status status = server->serve_metrics(); !status.ok()) return status;
  if (absl::Status status = server->load(); !status.ok()) return status;
  if (absl::Status status = server->listen(); !status.ok()) return status;
  server->is_ready_ = true;
  spdlog::info("serving {} models from {} on {}", server->models_->usage().models, config.model_dir.string(),
               server->address());
  return server;
}

Server::Server(const Config& config)
    : config_(config),
      writes_(std::chrono::seconds(config.write_timeout_seconds)),
      requests_(static_cast<std::size_t>(config.request_memory_mib) << 20,
                static_cast<std::size_t>(config.max_message_mib) << 20),
      detections_("detections", config.threads, static_cast<std::size_t>(config.queue)),
      trainings_("trainings", 1, kTrainingQueue, ComputePool::Priority::kLow) {}

Server::~Server() {
  stop();
  metrics_endpoint_.reset();  // it reads the rest
}

absl::Status Server::load() {
  if (absl::Status status = tokens_.load(config_.token_file); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<ModelStore>> models =
      ModelStore::open(config_.model_dir, {.memory_bytes = static_cast<std::size_t>(config_.models_memory_mib) << 20,
                                           .keep_generations = static_cast<std::size_t>(config_.keep_generations),
                                           .load_threads = config_.threads});
  if (!models.ok()) return models.status();
  models_ = *std::move(models);
  const Backend backend = {*models_, detections_, trainings_, requests_, tokens_, metrics_, drain_, writes_};
  model_service_ = std::make_unique<ModelService>(backend);
  detection_service_ = std::make_unique<DetectionService>(backend);
  return absl::OkStatus();
}

absl::Status Server::serve_metrics() {
  if (config_.metrics.empty()) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<MetricsEndpoint>> endpoint =
      MetricsEndpoint::start(config_.metrics, {.registry = metrics_.registry(),
                                               .before_scrape = [this] { update_metrics(); },
                                               .is_ready = [this] { return is_ready_.load(); },
                                               .detail = [this] { return directory_detail(); }});
  if (!endpoint.ok()) return endpoint.status();
  metrics_endpoint_ = *std::move(endpoint);
  metrics_address_ = with_port(config_.metrics, metrics_endpoint_->port());
  return absl::OkStatus();
}

bool Server::waits_for_directory() const {
  return models_->directory_age() > std::chrono::duration<double>(kDirectoryPatience).count();
}

std::string Server::directory_detail() const {
  if (!is_ready_ || !waits_for_directory()) return "";
  return absl::StrFormat("The model directory has not been read for %.0f s; the models of then are served.\n",
                         models_->directory_age());
}

void Server::update_metrics() {
  metrics_.waiting_detections().Set(static_cast<double>(detections_.waiting()));
  metrics_.waiting_trainings().Set(static_cast<double>(trainings_.waiting()));
  metrics_.request_bytes().Set(static_cast<double>(requests_.used()));
  metrics_.resident_bytes().Set(resident_bytes());
  if (!is_ready_) return;
  metrics_.set_models(models_->usage());
  metrics_.keep_models(models_->ids());
  metrics_.model_directory_age().Set(models_->directory_age());
  metrics_.set_skipped_model_files(models_->skipped_files());
}

absl::Status Server::listen() {
  enable_standard_services();
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(config_.listen, server_credentials(config_), &port);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);  // two servers on one port would share its calls
  limit_memory(config_, builder);
  reap_dead_peers(builder);
  builder.RegisterService(model_service_.get());
  builder.RegisterService(detection_service_.get());
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
  is_ready_ = false;
  grpc_server_->GetHealthCheckService()->SetServingStatus(false);
  std::this_thread::sleep_for(std::chrono::seconds(config_.drain_delay_seconds));
  drain_.start();
  if (!drain_.wait_for_calls(std::chrono::seconds(config_.drain_timeout_seconds))) {
    spdlog::warn("calls still run after {} s; they are cancelled", config_.drain_timeout_seconds);
  }
  // What still runs are watchers of health, which end only with the server; the time is for their NOT_SERVING to leave.
  grpc_server_->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  grpc_server_.reset();
}

}  // namespace binpose::server

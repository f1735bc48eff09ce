#include "client/servers.h"

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/client_interceptor.h>

#include <algorithm>
#include <random>
#include <utility>

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

std::shared_ptr<grpc::Channel> open_channel(const std::string& address, const Connection& connection) {
  grpc::ChannelArguments arguments;
  // The server states its own limits in its errors; gRPC's 4 MB would refuse answers here before anyone reads them.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // Notices a peer that vanished without a word. Servers take more than one ping in five minutes for abuse.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 310'000);
  // gRPC's own pauses, of up to two minutes, would outlast the restart of a server.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 2000);  // the longest that one attempt takes
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  if (!connection.token.empty()) interceptors.push_back(std::make_unique<TokenInterceptorFactory>(connection.token));
  return grpc::experimental::CreateCustomChannelWithInterceptors(address, credentials(connection), arguments,
                                                                 std::move(interceptors));
}

std::vector<std::string> split(const std::string& addresses) {
  std::vector<std::string> parts(1);
  for (const char c : addresses) {
    if (c == ',') {
      parts.emplace_back();
    } else if (c != ' ') {
      parts.back() += c;
    }
  }
  return parts;
}

}  // namespace

std::chrono::milliseconds pause_before(int attempt, const Retries& retries) {
  thread_local std::minstd_rand random{std::random_device{}()};
  double pause = static_cast<double>(retries.first_pause.count());
  const auto longest = static_cast<double>(retries.longest_pause.count());
  for (int i = 1; i < attempt && pause < longest; ++i) pause *= 2;
  pause = std::min(pause, longest) * std::uniform_real_distribution(0.5, 1.0)(random);
  return std::chrono::milliseconds(static_cast<std::int64_t>(pause));
}

Servers::Servers(const Connection& connection) : name_(connection.server) {
  for (const std::string& address : split(connection.server)) {
    const std::shared_ptr<grpc::Channel> channel = open_channel(address, connection);
    stubs_.push_back({channel, grpc::health::v1::Health::NewStub(channel), v1::ModelService::NewStub(channel)});
  }
}

void Servers::leave(const Stubs& lost) {
  auto index = static_cast<std::size_t>(&lost - stubs_.data());
  index_.compare_exchange_strong(index, (index + 1) % stubs_.size());
}

void set_routing_key(const std::string& model_id, grpc::ClientContext& context) {
  const auto is_printable = [](char c) { return c > ' ' && c <= '~'; };
  if (model_id.empty() || !std::all_of(model_id.begin(), model_id.end(), is_printable)) return;
  context.AddMetadata("x-model-id", model_id);
}

std::unique_ptr<DetectCall> open_detect(const Stubs& server, grpc::ClientContext& context) {
  // What the generated stub does; it takes messages only, and encodes them with a copy.
  const grpc::internal::RpcMethod method("/binpose.v1.DetectionService/Detect",
                                         grpc::internal::RpcMethod::BIDI_STREAMING);
  return std::unique_ptr<DetectCall>(
      grpc::internal::ClientReaderWriterFactory<grpc::ByteBuffer, v1::DetectResponse>::Create(server.channel.get(),
                                                                                              method, &context));
}

bool is_lost(const grpc::Status& status) {
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) return true;
  // What gRPC says of the ways in which a balancer passes on that a server went away. RST_STREAM 11 is the server's own
  // "too much".
  const std::string& text = status.error_message();
  if (text.find("error code 11") != std::string::npos) return false;
  for (const char* sign : {"RST_STREAM", "Stream removed", "No status received"}) {
    if (text.find(sign) != std::string::npos) return true;
  }
  return false;
}

}  // namespace binpose::client

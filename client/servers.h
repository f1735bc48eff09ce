#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "binpose/v1/detection_service.pb.h"
#include "binpose/v1/model_service.grpc.pb.h"
#include "client/connection.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace binpose::client {

/// The stubs of one server, or of the balancer before several.
struct Stubs {
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<grpc::health::v1::Health::Stub> health;
  std::unique_ptr<v1::ModelService::Stub> models;
};

/// The servers of a connection, of which one is called until it is lost. Connects with the first call. Thread-safe.
class Servers {
 public:
  explicit Servers(const Connection& connection);

  const Stubs& current() const { return stubs_[index_]; }
  /// Goes on to the next, unless another caller has done so.
  void leave(const Stubs& lost);

  /// Their addresses, for messages.
  const std::string& name() const { return name_; }
  std::size_t count() const { return stubs_.size(); }

 private:
  const std::string name_;
  std::vector<Stubs> stubs_;
  std::atomic<std::size_t> index_ = 0;
};

/// Tells a balancer which model a call is about, so that all calls about it go to one server: what one call did is seen
/// by the next. An ID that cannot be a header is left out.
void set_routing_key(const std::string& model_id, grpc::ClientContext& context);

/// A call of DetectionService.Detect whose scans are encoded already.
using DetectCall = grpc::ClientReaderWriter<grpc::ByteBuffer, v1::DetectResponse>;
std::unique_ptr<DetectCall> open_detect(const Stubs& server, grpc::ClientContext& context);

/// Whether a call ended because its server did, or the way to it, rather than because of what was asked.
bool is_lost(const grpc::Status& status);

}  // namespace binpose::client

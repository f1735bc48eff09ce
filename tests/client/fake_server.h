#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "binpose/v1/detection_service.grpc.pb.h"
#include "binpose/v1/model_service.grpc.pb.h"

namespace binpose::client {

/// A server in this process that answers what it is told to.
class FakeServer final : v1::ModelService::Service, v1::DetectionService::Service {
 public:
  using Answer = std::function<v1::DetectResponse(const v1::DetectRequest&)>;

  FakeServer() {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    builder.SetMaxReceiveMessageSize(-1);
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(static_cast<v1::ModelService::Service*>(this));
    builder.RegisterService(static_cast<v1::DetectionService::Service*>(this));
    server_ = builder.BuildAndStart();
  }
  ~FakeServer() override { server_->Shutdown(std::chrono::system_clock::now()); }
  FakeServer(const FakeServer&) = delete;
  FakeServer& operator=(const FakeServer&) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  void set_serving(bool serves) { server_->GetHealthCheckService()->SetServingStatus("", serves); }

  // To be set before the first call.
  Answer answer = [](const v1::DetectRequest&) { return v1::DetectResponse(); };
  int answers_before_end = -1;  ///< then the stream breaks; -1: never
  grpc::Status break_status = {grpc::StatusCode::INTERNAL, "The fake server has had enough."};
  int streams_that_break = -1;  ///< those after them do not; -1: all break
  grpc::Status call_status;     ///< of every call of the ModelService
  bool sends_model = true;

  std::vector<v1::DetectRequest> detect_requests() {
    const std::lock_guard lock(mutex_);
    return detect_requests_;
  }
  v1::TrainRequest train_request() {
    const std::lock_guard lock(mutex_);
    return train_request_;
  }
  int stream_count() {
    const std::lock_guard lock(mutex_);
    return stream_count_;
  }
  /// The header x-model-id of each stream.
  std::vector<std::string> routing_keys() {
    const std::lock_guard lock(mutex_);
    return routing_keys_;
  }

 private:
  using DetectChannel = grpc::ServerReaderWriter<v1::DetectResponse, v1::DetectRequest>;

  /// Takes no request before it has answered the last one: more back-pressure than the wire API's two requests ahead.
  grpc::Status Detect(grpc::ServerContext* context, DetectChannel* stream) override {
    int limit = answers_before_end;
    {
      const std::lock_guard lock(mutex_);
      if (stream_count_++ == streams_that_break) streams_that_break = 0;
      if (streams_that_break == 0) limit = -1;
      const auto key = context->client_metadata().find("x-model-id");
      const bool has_key = key != context->client_metadata().end();
      routing_keys_.push_back(has_key ? std::string(key->second.data(), key->second.size()) : "");
    }
    v1::DetectRequest request;
    for (int answered = 0; answered != limit; ++answered) {
      if (!stream->Read(&request)) return grpc::Status::OK;
      {
        const std::lock_guard lock(mutex_);
        detect_requests_.push_back(request);
      }
      v1::DetectResponse response = answer(request);
      response.set_request_id(request.request_id());
      if (!stream->Write(response)) return grpc::Status::CANCELLED;
    }
    return break_status;
  }

  grpc::Status Train(grpc::ServerContext* /*context*/, const v1::TrainRequest* request,
                     grpc::ServerWriter<v1::TrainResponse>* writer) override {
    {
      const std::lock_guard lock(mutex_);
      train_request_ = *request;
    }
    if (!call_status.ok()) return call_status;
    v1::TrainResponse response;
    response.set_stage(v1::TRAIN_STAGE_SAMPLING);
    response.set_progress(0.25);
    writer->Write(response);
    response.set_stage(v1::TRAIN_STAGE_DONE);
    response.set_progress(1);
    if (sends_model) response.mutable_model()->set_id(request->id());
    writer->Write(response);
    return grpc::Status::OK;
  }

  grpc::Status GetModel(grpc::ServerContext* /*context*/, const v1::GetModelRequest* request,
                        v1::Model* model) override {
    model->set_id(request->id());
    model->set_diameter(0.1);
    return call_status;
  }

  grpc::Status GetModelShape(grpc::ServerContext* /*context*/, const v1::GetModelShapeRequest* /*request*/,
                             v1::GetModelShapeResponse* shape) override {
    shape->set_surface("twelve bytes");
    return call_status;
  }

  grpc::Status ExportModel(grpc::ServerContext* /*context*/, const v1::ExportModelRequest* /*request*/,
                           grpc::ServerWriter<v1::ExportModelResponse>* writer) override {
    v1::ExportModelResponse part;
    part.set_data("a model");
    writer->Write(part);
    return call_status;
  }

  grpc::Status ListModels(grpc::ServerContext* /*context*/, const v1::ListModelsRequest* /*request*/,
                          v1::ListModelsResponse* models) override {
    models->add_models()->set_id("bolt");
    models->add_models()->set_id("gear");
    return call_status;
  }

  grpc::Status DeleteModel(grpc::ServerContext* /*context*/, const v1::DeleteModelRequest* /*request*/,
                           v1::DeleteModelResponse* /*response*/) override {
    return call_status;
  }

  std::mutex mutex_;
  std::vector<v1::DetectRequest> detect_requests_;
  v1::TrainRequest train_request_;
  int stream_count_ = 0;
  std::vector<std::string> routing_keys_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace binpose::client

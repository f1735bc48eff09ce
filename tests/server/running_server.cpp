#include "tests/server/running_server.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>

namespace binpose::server {

Config test_config(const std::filesystem::path& model_dir) {
  Config config;
  config.listen = "127.0.0.1:0";
  config.metrics = "";
  config.model_dir = model_dir;
  return config;
}

void RunningServer::start(const Config& config) {
  auto server = Server::start(config);
  if (!server.ok()) throw std::runtime_error(std::string(server.status().message()));
  server_ = *std::move(server);
  channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
  models_ = v1::ModelService::NewStub(channel_);
  detections_ = v1::DetectionService::NewStub(channel_);
}

grpc::Status RunningServer::train(const v1::TrainRequest& request, std::vector<v1::TrainResponse>* messages) {
  grpc::ClientContext context;
  const auto reader = models_->Train(&context, request);
  v1::TrainResponse message;
  while (reader->Read(&message)) {
    if (messages != nullptr) messages->push_back(message);
  }
  return reader->Finish();
}

std::vector<v1::DetectResponse> RunningServer::detect(const std::vector<v1::DetectRequest>& requests) {
  grpc::ClientContext context;
  const auto stream = detections_->Detect(&context);
  // Beside the reads: the server stops reading when nobody takes its answers.
  std::thread writer([&] {
    for (const v1::DetectRequest& request : requests) stream->Write(request);
    stream->WritesDone();
  });
  std::vector<v1::DetectResponse> answers;
  v1::DetectResponse answer;
  while (stream->Read(&answer)) answers.push_back(answer);
  writer.join();
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return answers;
}

}  // namespace binpose::server

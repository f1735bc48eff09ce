#pragma once

#include <functional>

#include "binpose/v1/model_service.grpc.pb.h"
#include "server/backend.h"

namespace binpose::server {

/// binpose.v1.ModelService.
class ModelService final : public v1::ModelService::CallbackService {
 public:
  explicit ModelService(const Backend& backend) : backend_(backend) {}

  grpc::ServerWriteReactor<v1::TrainResponse>* Train(grpc::CallbackServerContext* context,
                                                     const v1::TrainRequest* request) override;
  grpc::ServerUnaryReactor* GetModel(grpc::CallbackServerContext* context, const v1::GetModelRequest* request,
                                     v1::Model* response) override;
  grpc::ServerUnaryReactor* GetModelShape(grpc::CallbackServerContext* context, const v1::GetModelShapeRequest* request,
                                          v1::GetModelShapeResponse* response) override;
  grpc::ServerUnaryReactor* ListModels(grpc::CallbackServerContext* context, const v1::ListModelsRequest* request,
                                       v1::ListModelsResponse* response) override;
  grpc::ServerWriteReactor<v1::ExportModelResponse>* ExportModel(grpc::CallbackServerContext* context,
                                                                 const v1::ExportModelRequest* request) override;
  grpc::ServerReadReactor<v1::ImportModelRequest>* ImportModel(grpc::CallbackServerContext* context,
                                                               v1::ImportModelResponse* response) override;
  grpc::ServerUnaryReactor* DeleteModel(grpc::CallbackServerContext* context, const v1::DeleteModelRequest* request,
                                        v1::DeleteModelResponse* response) override;

 private:
  /// Ends a unary call about model `id` with what `answer` returns, which may wait for the disk. What is no ID is
  /// refused before it waits, since it may be as long as a message.
  grpc::ServerUnaryReactor* answer_on_pool(grpc::CallbackServerContext& context, Role role, Method method,
                                           const std::string& id,
                                           std::function<absl::Status(const std::string& id)> answer);

  Backend backend_;
};

}  // namespace binpose::server

#include "server/model_service.h"

#include <spdlog/spdlog.h>

#include <memory>
#include <string>
#include <utility>

#include "server/clock.h"
#include "server/convert_shape.h"
#include "server/convert_training.h"
#include "server/log.h"
#include "server/model_transfer.h"
#include "server/status.h"
#include "server/train_call.h"

namespace binpose::server {
namespace {

/// Ends a unary call and counts it.
void finish(grpc::ServerUnaryReactor* reactor, Metrics& metrics, Method method, Clock::time_point arrival,
            const absl::Status& status) {
  metrics.count_request(method, status.code(), seconds_since(arrival));
  reactor->Finish(to_grpc(status));
}

absl::Status get_model(const ModelStore& models, const std::string& id, v1::Model& response) {
  if (absl::Status status = check_model_id("id", id); !status.ok()) return status;
  absl::StatusOr<v1::Model> model = models.describe(id);
  if (!model.ok()) return model.status();
  response = *std::move(model);
  return absl::OkStatus();
}

absl::Status get_model_shape(ModelStore& models, const std::string& id, v1::GetModelShapeResponse& response) {
  const auto stored = models.find(id);
  if (!stored.ok()) return stored.status();
  response = shape_of((*stored)->model);
  return absl::OkStatus();
}

absl::Status delete_model(const Backend& backend, const std::string& id) {
  if (absl::Status status = backend.models.remove(id); !status.ok()) return status;
  spdlog::info("deleted {}", id);
  return absl::OkStatus();
}

}  // namespace

grpc::ServerWriteReactor<v1::TrainResponse>* ModelService::Train(grpc::CallbackServerContext* context,
                                                                 const v1::TrainRequest* request) {
  return new TrainCall(*request, backend_, *context, backend_.tokens.check(*context, Role::kTrain));
}

grpc::ServerWriteReactor<v1::ExportModelResponse>* ModelService::ExportModel(grpc::CallbackServerContext* context,
                                                                             const v1::ExportModelRequest* request) {
  return new ExportCall(request->id(), backend_, *context, backend_.tokens.check(*context, Role::kTrain));
}

grpc::ServerReadReactor<v1::ImportModelRequest>* ModelService::ImportModel(grpc::CallbackServerContext* context,
                                                                           v1::ImportModelResponse* response) {
  return new ImportCall(*response, backend_, backend_.tokens.check(*context, Role::kTrain));
}

grpc::ServerUnaryReactor* ModelService::GetModel(grpc::CallbackServerContext* context,
                                                 const v1::GetModelRequest* request, v1::Model* response) {
  const Clock::time_point arrival = Clock::now();
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  absl::Status status = backend_.tokens.check(*context, Role::kDetect);
  if (status.ok()) status = get_model(backend_.models, request->id(), *response);
  finish(reactor, backend_.metrics, Method::kGetModel, arrival, status);
  return reactor;
}

grpc::ServerUnaryReactor* ModelService::GetModelShape(grpc::CallbackServerContext* context,
                                                      const v1::GetModelShapeRequest* request,
                                                      v1::GetModelShapeResponse* response) {
  return answer_on_pool(
      *context, Role::kDetect, Method::kGetModelShape, request->id(),
      [this, response](const std::string& id) { return get_model_shape(backend_.models, id, *response); });
}

grpc::ServerUnaryReactor* ModelService::ListModels(grpc::CallbackServerContext* context,
                                                   const v1::ListModelsRequest* /*request*/,
                                                   v1::ListModelsResponse* response) {
  const Clock::time_point arrival = Clock::now();
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::Status allowed = backend_.tokens.check(*context, Role::kDetect);
  if (allowed.ok()) {
    for (v1::Model& model : backend_.models.list()) *response->add_models() = std::move(model);
  }
  finish(reactor, backend_.metrics, Method::kListModels, arrival, allowed);
  return reactor;
}

grpc::ServerUnaryReactor* ModelService::DeleteModel(grpc::CallbackServerContext* context,
                                                    const v1::DeleteModelRequest* request,
                                                    v1::DeleteModelResponse* /*response*/) {
  return answer_on_pool(*context, Role::kTrain, Method::kDeleteModel, request->id(),
                        [this](const std::string& id) { return delete_model(backend_, id); });
}

grpc::ServerUnaryReactor* ModelService::answer_on_pool(grpc::CallbackServerContext& context, Role role, Method method,
                                                       const std::string& id,
                                                       std::function<absl::Status(const std::string& id)> answer) {
  const Clock::time_point arrival = Clock::now();
  grpc::ServerUnaryReactor* reactor = context.DefaultReactor();
  absl::Status admitted = backend_.tokens.check(context, role);
  if (admitted.ok()) admitted = check_model_id("id", id);
  if (admitted.ok()) {
    const auto call = std::make_shared<Drain::Call>(backend_.drain);
    admitted = backend_.detections.submit([this, call, reactor, arrival, method, id, answer = std::move(answer)] {
      finish(reactor, backend_.metrics, method, arrival, contain_exceptions([&] { return answer(id); }));
    });
  }
  if (!admitted.ok()) finish(reactor, backend_.metrics, method, arrival, admitted);
  return reactor;
}

}  // namespace binpose::server

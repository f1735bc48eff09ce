#include "server/detection_service.h"

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/detect/detect.h"
#include "server/clock.h"
#include "server/convert_cloud.h"
#include "server/convert_detection.h"
#include "server/convert_geometry.h"
#include "server/detection_limits.h"
#include "server/frame_bytes.h"
#include "server/log.h"
#include "server/refused_stream.h"
#include "server/status.h"

namespace binpose::server {
namespace {

absl::Status check_request(const v1::DetectRequest& request) {
  if (request.request_id().size() > kMaxRequestIdBytes) {
    return absl::InvalidArgumentError(
        absl::StrFormat("request_id has %d bytes; the limit is %d.", request.request_id().size(), kMaxRequestIdBytes));
  }
  if (request.model_ids().empty() || request.model_ids_size() > kMaxModelsPerRequest) {
    return absl::InvalidArgumentError(absl::StrFormat("model_ids has %d entries; it must have 1 to %d.",
                                                      request.model_ids_size(), kMaxModelsPerRequest));
  }
  std::set<std::string> seen;
  for (const std::string& id : request.model_ids()) {
    if (absl::Status status = check_model_id("model_ids", id); !status.ok()) return status;
    if (!seen.insert(id).second) {
      return absl::InvalidArgumentError(absl::StrFormat("model_ids names '%s' twice; once is enough.", id));
    }
  }
  return absl::OkStatus();
}

/// The caller's control, with the request's time budget. Errors: INVALID_ARGUMENT.
absl::StatusOr<RunControl> limit_time(const v1::DetectRequest& request, Clock::time_point arrival,
                                      const RunControl& control) {
  constexpr double kLeast = 0.001;
  constexpr double kMost = 3600;
  if (!request.has_time_budget_seconds()) return control;
  const double seconds = request.time_budget_seconds();
  if (!(seconds >= kLeast && seconds <= kMost)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("time_budget_seconds is %g; it must lie in [%g, %g].", seconds, kLeast, kMost));
  }
  RunControl limited = control;
  const Clock::time_point end =
      arrival + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  limited.deadline = std::min(end, control.deadline.value_or(end));
  return limited;
}

absl::StatusOr<std::vector<std::shared_ptr<const StoredModel>>> find_models(const v1::DetectRequest& request,
                                                                            ModelStore& models) {
  std::vector<std::shared_ptr<const StoredModel>> found;
  for (const std::string& id : request.model_ids()) {
    absl::StatusOr<std::shared_ptr<const StoredModel>> model = models.find(id);
    if (!model.ok()) return model.status();
    found.push_back(*std::move(model));
  }
  return found;
}

}  // namespace

absl::StatusOr<v1::DetectResponse> find_parts(const v1::DetectRequest& request, ModelStore& models,
                                              const RunControl& control) {
  if (absl::Status status = check_request(request); !status.ok()) return status;
  const auto stored = find_models(request, models);
  if (!stored.ok()) return stored.status();
  const absl::StatusOr<double> unit = metres_per_unit("cloud.unit", request.cloud().unit());
  if (!unit.ok()) return unit.status();
  const absl::StatusOr<DetectParams> params = to_detect_params(request.params(), request.model_ids(), *unit);
  if (!params.ok()) return params.status();
  const absl::StatusOr<PointCloud> cloud = to_cloud(request.cloud(), {.stop = control.stop});
  if (!cloud.ok()) return cloud.status();

  std::vector<const Model*> wanted;
  for (const auto& model : *stored) wanted.push_back(&model->model);
  const absl::StatusOr<DetectResult> result = detect(*cloud, wanted, *params, control);
  if (!result.ok()) return result.status();
  return to_response(*result, request.model_ids(), *unit);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* DetectionService::Detect(
    grpc::CallbackServerContext* context) {
  if (absl::Status allowed = backend_.tokens.check(*context, Role::kDetect); !allowed.ok()) {
    backend_.metrics.count_request(Method::kDetect, allowed.code(), 0);
    return new RefusedStream(to_grpc(allowed));
  }
  return new DetectStream(
      {*this, backend_.detections, backend_.requests, backend_.drain, backend_.writes, backend_.metrics.streams()},
      *context, compute_deadline(context->deadline()), trace_id_of(*context));
}

grpc::ByteBuffer DetectionService::answer(grpc::ByteBuffer& frame, Clock::time_point arrival,
                                          const RunControl& control) {
  const double queue_seconds = seconds_since(arrival);
  std::string request_id = request_id_of(frame);
  const absl::StatusOr<v1::DetectResponse> found = contain_exceptions([&]() -> absl::StatusOr<v1::DetectResponse> {
    if (control.stop.stop_requested()) return control.status();  // nobody waits: not worth decoding
    const std::size_t bytes = frame.Length();
    v1::DetectRequest request;
    if (!decode(frame, request)) {
      return absl::InvalidArgumentError(absl::StrFormat("The frame's %d bytes are no DetectRequest.", bytes));
    }
    request_id = request.request_id();
    const absl::StatusOr<RunControl> within_budget = limit_time(request, arrival, control);
    if (!within_budget.ok()) return within_budget.status();
    absl::StatusOr<v1::DetectResponse> found = find_parts(request, backend_.models, *within_budget);
    if (found.ok()) backend_.metrics.count_search(request.model_ids(), *found);
    return found;
  });
  const LogRequest log_request(request_id);
  v1::DetectResponse response;
  if (found.ok()) {
    response = *found;
    response.mutable_stats()->set_queue_seconds(queue_seconds);
    backend_.metrics.observe_detection(response.stats(), static_cast<std::size_t>(response.hypotheses_size()));
  } else {
    *response.mutable_error() = to_error(found.status());
    log_failure("a detection", found.status());
  }
  response.set_request_id(request_id);
  backend_.metrics.count_request(Method::kDetect, found.status().code(), seconds_since(arrival));
  return encode(response);
}

grpc::ByteBuffer DetectionService::refuse(grpc::ByteBuffer& frame, const absl::Status& reason) {
  v1::DetectResponse response;
  response.set_request_id(request_id_of(frame));
  *response.mutable_error() = to_error(reason);
  backend_.metrics.count_request(Method::kDetect, reason.code(), 0);
  backend_.metrics.count_refusal(reason);
  return encode(response);
}

void DetectionService::note_cancel(CancelPlace place, double seconds) {
  backend_.metrics.observe_cancel(place == CancelPlace::kQueue ? "queue" : "compute", seconds);
}

}  // namespace binpose::server

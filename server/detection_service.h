#pragma once

#include "absl/status/statusor.h"
#include "binpose/v1/detection_service.grpc.pb.h"
#include "core/run_control.h"
#include "server/backend.h"
#include "server/clock.h"
#include "server/detect_stream.h"

namespace binpose::server {

/// Convert, look up, detect, convert. Errors: those of DetectResponse.error.
absl::StatusOr<v1::DetectResponse> find_parts(const v1::DetectRequest& request, ModelStore& models,
                                              const RunControl& control);

/// binpose.v1.DetectionService; its frames are bytes until a thread of the pool decodes them.
class DetectionService final : public v1::DetectionService::WithRawCallbackMethod_Detect<v1::DetectionService::Service>,
                               private FrameHandler {
 public:
  explicit DetectionService(const Backend& backend) : backend_(backend) {}

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Detect(grpc::CallbackServerContext* context) override;

 private:
  grpc::ByteBuffer answer(grpc::ByteBuffer& frame, Clock::time_point arrival, const RunControl& control) override;
  grpc::ByteBuffer refuse(grpc::ByteBuffer& frame, const absl::Status& reason) override;
  void note_cancel(CancelPlace place, double seconds) override;

  Backend backend_;
};

}  // namespace binpose::server

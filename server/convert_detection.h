#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "binpose/v1/detection_service.pb.h"
#include "core/hypothesis.h"
#include "core/params.h"

namespace binpose::server {

/// How to search, in metres and radians.
///
/// @param model_ids        those that are searched for; what PosePrior::model_id names.
/// @param metres_per_unit  of the lengths in `message`, which are the cloud's.
/// Errors: INVALID_ARGUMENT, naming field, value and range.
absl::StatusOr<DetectParams> to_detect_params(const v1::DetectParams& message,
                                              const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                                              double metres_per_unit);

/// The answer that holds `result`.
///
/// @param model_ids        what PoseHypothesis::model_index points into.
/// @param metres_per_unit  of the cloud, which is that of the answer as well.
v1::DetectResponse to_response(const DetectResult& result,
                               const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                               double metres_per_unit);

}  // namespace binpose::server

#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "binpose/v1/detection_service.pb.h"
#include "core/search_space.h"

namespace binpose::server {

/// Where parts may be, in metres; directions and normals get unit length.
///
/// @param model_ids        what PosePrior::model_id names.
/// @param metres_per_unit  of the lengths in `message`.
/// Errors: INVALID_ARGUMENT, naming the field, for what can't be converted; core checks the ranges.
absl::StatusOr<SearchSpace> to_search_space(const v1::DetectParams& message,
                                            const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                                            double metres_per_unit);

}  // namespace binpose::server

#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "binpose/v1/model_service.pb.h"
#include "core/geometry/mesh.h"
#include "core/params.h"
#include "core/train/train.h"
#include "server/model_envelope.h"

namespace binpose::server {

/// Errors: INVALID_ARGUMENT, naming field, value and range.
absl::StatusOr<TrainParams> to_train_params(const v1::TrainParams& message);

/// Errors: those of read_mesh(), INVALID_ARGUMENT (unit or format), RESOURCE_EXHAUSTED (more than kMaxDecodeTime).
absl::StatusOr<Mesh> to_mesh(const v1::Mesh& message, const RunControl& control = {});

/// A warning when a part of that diameter, metres, is so large or small that `unit` must be doubted.
std::optional<std::string> doubt_unit(double diameter, v1::LengthUnit unit);

v1::TrainStage to_proto(TrainStage stage);

v1::Model to_proto(const StoredModel& stored);

}  // namespace binpose::server

#pragma once

#include "binpose/v1/model_service.pb.h"
#include "core/model.h"

namespace binpose::server {

/// The points and vector pairs of a model, packed for the wire.
v1::GetModelShapeResponse shape_of(const Model& model);

}  // namespace binpose::server

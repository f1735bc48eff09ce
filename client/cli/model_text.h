#pragma once

#include <string>

#include "binpose/v1/model_service.pb.h"
#include "client/cli/table.h"

namespace binpose::client::cli {

/// One model a row.
Table table_of(const v1::ListModelsResponse& models);

/// One fact about a model a row, its warnings last.
Table details_of(const v1::Model& model);

}  // namespace binpose::client::cli

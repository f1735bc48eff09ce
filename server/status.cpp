#include "server/status.h"

#include <string>

namespace binpose::server {

grpc::Status to_grpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message())};
}

v1::Error to_error(const absl::Status& status) {
  v1::Error error;
  error.set_code(static_cast<int>(status.code()));
  error.set_message(std::string(status.message()));
  return error;
}

absl::Status in_field(const char* field, const absl::Status& error) {
  return {error.code(), absl::StrCat(field, ": ", error.message())};
}

}  // namespace binpose::server

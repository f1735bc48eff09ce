#include "server/status.h"

#include <string>

#include "google/rpc/status.pb.h"
#include "server/refusal.h"

namespace binpose::server {

grpc::Status to_grpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  google::rpc::Status details;
  if (const auto retry_info = retry_info_of(status)) {
    details.set_code(static_cast<int>(status.code()));
    details.set_message(std::string(status.message()));
    details.add_details()->PackFrom(*retry_info);
  }
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message()), details.SerializeAsString()};
}

v1::Error to_error(const absl::Status& status) {
  v1::Error error;
  error.set_code(static_cast<int>(status.code()));
  error.set_message(std::string(status.message()));
  if (const auto retry_info = retry_info_of(status)) *error.mutable_retry_delay() = retry_info->retry_delay();
  return error;
}

absl::Status in_field(const char* field, const absl::Status& error) {
  return {error.code(), absl::StrCat(field, ": ", error.message())};
}

}  // namespace binpose::server

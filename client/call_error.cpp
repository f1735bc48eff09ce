#include "client/call_error.h"

namespace binpose::client {
namespace {

/// What went wrong and what to do next. The server's own sentences say both; what gRPC itself says does not.
std::string explain(const grpc::Status& status, const std::string& server) {
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return "no binpose server answers at " + server + " (" + status.error_message() +
             "). Is binpose-server running there, and is the address right?";
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return "the server at " + server + " took too long. Try again, or allow more time.";
    case grpc::StatusCode::UNIMPLEMENTED:
      return "what answers at " + server + " does not offer this call: it is another service, or another version.";
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      // What gRPC says of a message so large that the server never sees it.
      if (status.error_message().find("larger than max") != std::string::npos) {
        return status.error_message() + ". Send less, or raise the server's --max-message-mib.";
      }
      // ENHANCE_YOUR_CALM: what gRPC says when its memory is full before the message is there.
      if (status.error_message().find("RST_STREAM with error code 11") != std::string::npos) {
        return "the server's memory for requests is full. Send less, try again later, or raise the server's "
               "--request-memory-mib.";
      }
      return status.error_message();
    default:
      return status.error_message();
  }
}

}  // namespace

absl::Status call_error(const grpc::Status& status, const CallName& call) {
  if (status.ok()) return absl::OkStatus();
  return {static_cast<absl::StatusCode>(status.error_code()), call.what + " failed: " + explain(status, call.server)};
}

absl::Status frame_error(const v1::DetectResponse& answer) {
  if (!answer.has_error()) return absl::OkStatus();
  // An error without a code is an error all the same.
  const int code = answer.error().code() == 0 ? static_cast<int>(absl::StatusCode::kUnknown) : answer.error().code();
  return {static_cast<absl::StatusCode>(code), answer.error().message()};
}

}  // namespace binpose::client

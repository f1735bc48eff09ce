#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "absl/status/status.h"
#include "binpose/v1/detection_service.pb.h"

namespace binpose::client {

/// What was asked, and of whom; for error messages.
struct CallName {
  std::string what;    ///< for example `Deleting model "gear"`
  std::string server;  ///< HOST:PORT
};

/// OK, or the error of a call as a sentence: what failed, where, and what to do next.
absl::Status call_error(const grpc::Status& status, const CallName& call);

/// OK, or the error that an answer carries for its one frame.
absl::Status frame_error(const v1::DetectResponse& answer);

}  // namespace binpose::client

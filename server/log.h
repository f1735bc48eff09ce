#pragma once

#include <grpcpp/server_context.h>

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace binpose::server {

enum class LogFormat { kText, kJson };

/// Sends spdlog's default logger, and protobuf's through it, to standard error. In either format a line carries the
/// trace and request that the thread works for.
///
/// @param level  one of spdlog's level names, for example "info".
void log_to_stderr(const std::string& level, LogFormat format);

/// The trace ID, 32 hexadecimal digits, of the W3C header "traceparent"; empty when there is none.
std::string trace_id_of(const grpc::CallbackServerContext& context);
std::string trace_id_of(std::string_view traceparent);

/// While it lives, lines that this thread logs carry a trace ID.
class LogTrace {
 public:
  explicit LogTrace(std::string_view trace_id);
  ~LogTrace();
  LogTrace(const LogTrace&) = delete;
  LogTrace& operator=(const LogTrace&) = delete;
};

/// While it lives, lines that this thread logs carry a request ID.
class LogRequest {
 public:
  explicit LogRequest(std::string_view request_id);
  ~LogRequest();
  LogRequest(const LogRequest&) = delete;
  LogRequest& operator=(const LogRequest&) = delete;
};

/// Logs that `what`, for example "a detection", failed, unless its caller cancelled it; at most some lines a second, so
/// that no client fills the disk.
void log_failure(std::string_view what, const absl::Status& status);

}  // namespace binpose::server

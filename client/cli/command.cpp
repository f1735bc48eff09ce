#include "client/cli/command.h"

#include <iostream>

#include "client/cli/style.h"

namespace binpose::client::cli {

Client connect(const GlobalOptions& global) {
  Timeouts timeouts;
  if (global.timeout_seconds.has_value()) {
    const std::chrono::milliseconds timeout(static_cast<std::int64_t>(1000 * *global.timeout_seconds));
    timeouts = {.call = timeout, .training = timeout, .answer = timeout};
  }
  return Client(global.server, timeouts);
}

void report(const absl::Status& error) {
  std::cerr << coloured("binpose: ", Colour::kRed, stderr) << error.message() << std::endl;
}

ExitCode report_call(const absl::Status& error) {
  report(error);
  return absl::IsUnavailable(error) || absl::IsDeadlineExceeded(error) ? kUnreachable : kRefused;
}

}  // namespace binpose::client::cli

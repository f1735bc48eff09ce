#include "client/cli/command.h"

#include <iostream>

#include "client/cli/style.h"
#include "client/read_file.h"

namespace binpose::client::cli {

namespace {

/// The file's text; empty without a file.
std::string text_of(const std::string& file) {
  if (file.empty()) return "";
  const absl::StatusOr<std::string> text = read_file(file);
  if (text.ok()) return *text;
  report(text.status());
  throw CLI::RuntimeError(kUnreadable);
}

std::string first_line(const std::string& text) { return text.substr(0, text.find_first_of("\r\n")); }

}  // namespace

Client connect(const GlobalOptions& global) {
  Timeouts timeouts;
  if (global.timeout_seconds.has_value()) {
    const std::chrono::milliseconds timeout(static_cast<std::int64_t>(1000 * *global.timeout_seconds));
    timeouts = {.call = timeout, .training = timeout, .answer = timeout};
  }
  return Client(Connection{.server = global.server,
                           .tls_ca = text_of(global.tls_ca),
                           .tls_cert = text_of(global.tls_cert),
                           .tls_key = text_of(global.tls_key),
                           .token = first_line(text_of(global.token_file))},
                timeouts, Retries{.attempts = global.retries});
}

void report(const absl::Status& error) {
  std::cerr << coloured("binpose: ", Colour::kRed, stderr) << error.message() << std::endl;
}

ExitCode report_call(const absl::Status& error) {
  report(error);
  return absl::IsUnavailable(error) || absl::IsDeadlineExceeded(error) ? kUnreachable : kRefused;
}

}  // namespace binpose::client::cli

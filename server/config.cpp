#include "server/config.h"

#include <CLI/CLI.hpp>

namespace binpose::server {
namespace {

/// Empty if all is well, or what is wrong with a text that should be HOST:PORT.
std::string check_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::string fault = "'" + text + "' is not HOST:PORT with a port from 0 to 65535";
  if (colon == std::string::npos || colon == 0) return fault;
  const std::string port = text.substr(colon + 1);
  const bool is_number = !port.empty() && port.size() <= 5 && port.find_first_not_of("0123456789") == std::string::npos;
  if (is_number && std::stoi(port) <= 65535) return "";
  return fault;
}

}  // namespace

void add_options(CLI::App& app, Config& config) {
  const CLI::Validator address(check_address, "HOST:PORT");
  app.option_defaults()->always_capture_default();
  app.add_option("--listen", config.listen, "Address of the gRPC services, plaintext; port 0 = a free one")
      ->check(address);
  app.add_option("--metrics", config.metrics, "Address of GET /metrics; port 0 = a free one, '' = not served")
      ->check(address | CLI::IsMember({""}));
  app.add_option("--model-dir", config.model_dir, "Directory that keeps the models; made if it is missing");
  app.add_option("--threads", config.threads, "Threads that compute detections")->check(CLI::Range(1, 1024));
  app.add_option("--queue", config.queue, "Detections that may wait for a thread; more are refused")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--max-message-mib", config.max_message_mib, "Largest message that is taken, MiB")
      ->check(CLI::Range(1, 1024));
  app.add_option("--drain-timeout", config.drain_timeout_seconds, "Seconds that calls may go on after SIGTERM")
      ->check(CLI::Range(0, 3600));
  app.add_option("--log-level", config.log_level, "What is logged to standard error")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}));
}

}  // namespace binpose::server

#include "server/config.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "server/tls.h"
#include "server/tokens.h"

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

bool is_loopback(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  return host == "localhost" || host == "[::1]" || absl::StartsWith(host, "127.");
}

void add_security_options(CLI::App& app, Config& config) {
  app.add_option("--tls-cert", config.tls_cert, "PEM file of the certificate chain; read again when it changes");
  app.add_option("--tls-key", config.tls_key, "PEM file of its key");
  app.add_option("--tls-client-ca", config.tls_client_ca, "PEM file of authorities; callers must show a certificate");
  app.add_option("--token-file", config.token_file,
                 "File of bearer tokens, one 'detect TOKEN' or 'train TOKEN' a line; read again when it changes");
  app.add_flag("--insecure", config.insecure, "Plaintext beyond loopback is meant");
}

void add_limit_options(CLI::App& app, Config& config) {
  app.add_option("--threads", config.threads, "Threads that compute detections")->check(CLI::Range(1, 1024));
  app.add_option("--queue", config.queue, "Detections that may wait for a thread; more are refused")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--max-message-mib", config.max_message_mib, "Largest message that is taken, MiB")
      ->check(CLI::Range(1, 1024));
  app.add_option("--request-memory-mib", config.request_memory_mib,
                 "Requests that may wait or be computed at a time, MiB; more are refused")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--models-memory-mib", config.models_memory_mib,
                 "Memory for models, MiB; beyond it those that were not used longest leave until they are wanted")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--keep-generations", config.keep_generations,
                 "Generations of a model that stay in the directory, the one that is served included")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--drain-delay", config.drain_delay_seconds,
                 "Seconds after SIGTERM in which calls are still taken, while /readyz and health say no to a balancer")
      ->check(CLI::Range(0, 3600));
  app.add_option("--drain-timeout", config.drain_timeout_seconds, "Seconds that calls may go on after that")
      ->check(CLI::Range(0, 3600));
  app.add_option("--write-timeout", config.write_timeout_seconds,
                 "Seconds that a caller may leave an answer untaken; then its call is cancelled")
      ->check(CLI::Range(1, 3600));
}

}  // namespace

void add_options(CLI::App& app, Config& config) {
  const CLI::Validator address(check_address, "HOST:PORT");
  app.option_defaults()->always_capture_default()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.set_config("--config", "", "TOML file of these options, without their dashes");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.add_option("--listen", config.listen, "Address of the gRPC services; port 0 = a free one")->check(address);
  app.add_option("--metrics", config.metrics,
                 "Address of GET /metrics, /healthz and /readyz; port 0 = a free one, '' = not served")
      ->check(address | CLI::IsMember({""}));
  app.add_option("--model-dir", config.model_dir, "Directory that keeps the models; made if it is missing");
  add_limit_options(app, config);
  add_security_options(app, config);
  app.add_option("--log-level", config.log_level, "What is logged to standard error")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}));
  app.add_option("--log-format", config.log_format, "How it is logged")->check(CLI::IsMember({"text", "json"}));
}

std::vector<std::string> all_arguments(const CLI::App& app, std::vector<std::string> command_line) {
  std::vector<std::string> arguments;
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_single_name();
    const std::string variable = "BINPOSE_" + absl::AsciiStrToUpper(absl::StrReplaceAll(name, {{"-", "_"}}));
    const char* value = std::getenv(variable.c_str());  // NOLINT(concurrency-mt-unsafe): before any thread starts
    const bool is_setting = option->get_configurable() || name == "config";
    if (is_setting && value != nullptr) arguments.push_back(absl::StrFormat("--%s=%s", name, value));
  }
  arguments.insert(arguments.end(), command_line.begin(), command_line.end());
  std::reverse(arguments.begin(), arguments.end());
  return arguments;
}

absl::Status check(const Config& config) {
  const bool has_tls = !config.tls_cert.empty();
  if (has_tls != !config.tls_key.empty()) {
    return absl::InvalidArgumentError("--tls-cert and --tls-key belong together; only one is set.");
  }
  if (!has_tls && !config.tls_client_ca.empty()) {
    return absl::InvalidArgumentError("--tls-client-ca needs --tls-cert and --tls-key.");
  }
  if (!has_tls && !config.insecure && !is_loopback(config.listen)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "--listen %s would serve other machines in plaintext: set --tls-cert and --tls-key, or, where the network is "
        "closed, --insecure.",
        config.listen));
  }
  if (has_tls) {
    if (absl::Status status = check_tls_files(config); !status.ok()) return status;
  }
  if (absl::Status status = Tokens().load(config.token_file); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrFormat("--token-file: %s", status.message()));
  }
  return absl::OkStatus();
}

}  // namespace binpose::server

#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"

namespace CLI {  // NOLINT(readability-identifier-naming): named by the library
class App;
}

namespace binpose::server {

/// How the server runs. A default is written here only.
struct Config {
  /// HOST:PORT of the gRPC services; port 0 = a free one. In plaintext it must be loopback, because whoever reaches it
  /// may train and delete, unless `insecure` is said.
  std::string listen = "127.0.0.1:50051";
  /// HOST:PORT of GET /metrics, /healthz and /readyz; port 0 = a free one; empty = not served.
  std::string metrics = "127.0.0.1:9464";
  /// Where models are kept; made if it is missing.
  std::filesystem::path model_dir = "models";
  /// Threads that compute detections.
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  /// Detections that may wait for a thread; more are refused.
  int queue = 64;
  /// Largest message that is taken.
  int max_message_mib = 64;
  /// Bytes of requests that may wait or be computed at a time. gRPC's buffers may take as much again.
  int request_memory_mib = 512;
  /// Sum of the sizes of the model files that are served.
  int models_memory_mib = 1024;
  /// Generations of a model that stay in the directory, the one that is served included.
  int keep_generations = 2;
  /// How long the server says that it is not ready and takes calls all the same, after SIGTERM: for a balancer to see
  /// it.
  int drain_delay_seconds = 0;
  /// How long calls may go on after SIGTERM.
  int drain_timeout_seconds = 30;
  /// How long a caller may leave a message of its call untaken, before the call is cancelled.
  int write_timeout_seconds = 60;
  /// PEM files of the certificate chain and its key; empty = plaintext. Read again when they change.
  std::filesystem::path tls_cert;
  std::filesystem::path tls_key;
  /// PEM file of the authorities whose certificates callers must show; empty = callers need none.
  std::filesystem::path tls_client_ca;
  /// See Tokens; empty = whoever reaches the server may do all.
  std::filesystem::path token_file;
  /// Plaintext for other machines is meant.
  bool insecure = false;
  /// One of spdlog's levels.
  std::string log_level = "info";
  /// "text" or "json".
  std::string log_format = "text";
};

/// Makes the command line and configuration file of `app` fill `config`.
void add_options(CLI::App& app, Config& config);

/// What `app` is to parse, in the order that CLI11 wants: what the variables BINPOSE_<OPTION> say, then the command
/// line, which wins; both win over the configuration file.
std::vector<std::string> all_arguments(const CLI::App& app, std::vector<std::string> command_line);

/// OK, or INVALID_ARGUMENT naming the options that do not go together or the file that cannot be used.
absl::Status check(const Config& config);

}  // namespace binpose::server

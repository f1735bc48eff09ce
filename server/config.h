#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>

namespace CLI {  // NOLINT(readability-identifier-naming): named by the library
class App;
}

namespace binpose::server {

/// How the server runs. A default is written here only.
struct Config {
  /// HOST:PORT of the gRPC services, plaintext; port 0 = a free one. Loopback unless told otherwise, because whoever
  /// reaches it may train and delete. 0.0.0.0 is allowed, for containers whose network is closed.
  std::string listen = "127.0.0.1:50051";
  /// HOST:PORT of GET /metrics; port 0 = a free one; empty = not served.
  std::string metrics = "127.0.0.1:9464";
  /// Where models are kept; made if it is missing.
  std::filesystem::path model_dir = "models";
  /// Threads that compute detections.
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  /// Detections that may wait for a thread; more are refused.
  int queue = 64;
  /// Largest message that is taken.
  int max_message_mib = 64;
  /// How long calls may go on after SIGTERM.
  int drain_timeout_seconds = 30;
  /// One of spdlog's levels.
  std::string log_level = "info";
};

/// Makes the command line of `app` fill `config`.
void add_options(CLI::App& app, Config& config);

}  // namespace binpose::server

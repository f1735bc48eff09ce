#include <malloc.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <future>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include "server/config.h"
#include "server/log.h"
#include "server/server.h"

namespace {

sigset_t end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  return signals;
}

/// Keeps the memory of a scan for the next one: to have it from the system anew costs more than to decode the scan.
void keep_memory_of_scans() {
  constexpr int kMiB = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMiB);
  mallopt(M_TRIM_THRESHOLD, 64 * kMiB);
  // An arena for each core, in place of eight: else scan after scan lands in the arena of another of gRPC's threads,
  // and the process grows for hours.
  mallopt(M_ARENA_MAX, std::max(2, static_cast<int>(std::thread::hardware_concurrency())));
}

enum class Action { kServe, kPrintConfig, kCheckConfig, kHealthcheck };

void add_actions(CLI::App& app, Action& action) {
  const auto add = [&](const char* name, Action chosen, const char* help) {
    app.add_flag_callback(
           name, [&action, chosen] { action = chosen; }, help)
        ->configurable(false);
  };
  add("--print-config", Action::kPrintConfig, "Print the settings as a configuration file, and end");
  add("--check-config", Action::kCheckConfig, "Say whether the settings can be used, and end");
  add("--healthcheck", Action::kHealthcheck, "Say whether the server at --metrics is ready, and end");
}

absl::Status healthcheck(const binpose::server::Config& config) {
  if (config.metrics.empty()) return absl::InvalidArgumentError("--healthcheck asks --metrics, which is empty.");
  return binpose::server::probe(config.metrics, "/readyz");
}

using binpose::server::Server;

/// A server once it serves. Ends the process on one of `signals` before: a share may hang for hours.
absl::StatusOr<std::unique_ptr<Server>> start(const binpose::server::Config& config, const sigset_t& signals) {
  auto server = std::async(std::launch::async, [&config] { return Server::start(config); });
  while (server.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    constexpr timespec kLookAfter = {.tv_sec = 0, .tv_nsec = 10'000'000};
    if (const int signal = sigtimedwait(&signals, nullptr, &kLookAfter); signal > 0) {
      spdlog::info("ending on signal {} before serving", signal);
      std::_Exit(EXIT_SUCCESS);
    }
  }
  return server.get();
}

int report(const absl::Status& status) {
  if (status.ok()) return EXIT_SUCCESS;
  std::cerr << status.message() << std::endl;
  return EXIT_FAILURE;
}

}  // namespace

int main(int argc, char** argv) {
  keep_memory_of_scans();
  binpose::server::Config config;
  CLI::App app("Trains models of parts and finds them in point clouds; serves binpose.v1 over gRPC.", "binpose-server");
  binpose::server::add_options(app, config);
  Action action = Action::kServe;
  add_actions(app, action);
  app.set_version_flag("--version", "binpose-server " BINPOSE_VERSION);
  try {
    app.parse(binpose::server::all_arguments(app, {argv + 1, argv + argc}));
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  }
  if (action == Action::kPrintConfig) {
    std::cout << app.config_to_str(true);
    return EXIT_SUCCESS;
  }
  if (action == Action::kCheckConfig) return report(check(config));
  if (action == Action::kHealthcheck) return report(healthcheck(config));
  using binpose::server::LogFormat;
  log_to_stderr(config.log_level, config.log_format == "json" ? LogFormat::kJson : LogFormat::kText);

  // Before any thread starts, so that only sigwait() sees them.
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);

  const auto server = start(config, signals);
  if (!server.ok()) {
    spdlog::critical("{}", std::string(server.status().message()));
    return EXIT_FAILURE;
  }
  std::cout << "listening on " << (*server)->address();
  if (!config.metrics.empty()) std::cout << ", metrics on " << (*server)->metrics_address();
  std::cout << std::endl;

  int signal = 0;
  sigwait(&signals, &signal);
  spdlog::info("ending on signal {}", signal);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);  // a second one ends the process at once
  (*server)->stop();
  if ((*server)->waits_for_directory()) std::_Exit(EXIT_SUCCESS);  // a share may hang for hours
  return EXIT_SUCCESS;
}

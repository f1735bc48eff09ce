#include <pthread.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string>

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

}  // namespace

int main(int argc, char** argv) {
  binpose::server::Config config;
  CLI::App app("Trains models of parts and finds them in point clouds; serves binpose.v1 over gRPC.");
  binpose::server::add_options(app, config);
  CLI11_PARSE(app, argc, argv);
  binpose::server::log_to_stderr(config.log_level);

  // Before any thread starts, so that only sigwait() sees them.
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);

  const auto server = binpose::server::Server::start(config);
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
  return EXIT_SUCCESS;
}

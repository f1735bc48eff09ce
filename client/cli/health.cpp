#include <iostream>

#include "client/cli/command.h"

namespace binpose::client::cli {
namespace {

ExitCode check_health(const GlobalOptions& global) {
  if (absl::Status status = connect(global).check_health(); !status.ok()) return report_call(status);
  std::cout << (global.json ? "{\"status\":\"SERVING\"}" : "serving") << std::endl;
  return kOk;
}

}  // namespace

void add_health(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  CLI::App& command = *app.add_subcommand("health", "Ask whether the server takes calls; exits with 0 if it does");
  command.footer("\nExamples:\n  binpose health --timeout 2 && binpose models");
  command.callback([&chosen, &global] { chosen = [&global] { return check_health(global); }; });
}

}  // namespace binpose::client::cli

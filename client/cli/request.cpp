#include <iostream>
#include <memory>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/scan_options.h"

namespace binpose::client::cli {
namespace {

ExitCode print_requests(const ScanOptions& options) {
  ExitCode exit_code = kOk;
  for (const std::string& scene : options.scenes) {
    const absl::StatusOr<v1::DetectRequest> request = make_request(options, scene);
    if (request.ok()) {
      std::cout << request_json(*request) << '\n';
    } else {
      report(request.status());
      exit_code = kUnreadable;
    }
  }
  return exit_code;
}

}  // namespace

void add_request(CLI::App& app, const GlobalOptions& /*global*/, Command& chosen) {
  const auto options = std::make_shared<ScanOptions>();
  CLI::App& command = *app.add_subcommand("request", "Print what `detect` would send, as JSON for `grpcurl -d @`");
  command.footer(
      "\nExamples:\n"
      "  binpose request --model gear --scene bin.ply --unit mm | grpcurl -plaintext -d @ localhost:50051 \\\n"
      "      binpose.v1.DetectionService/Detect");
  add_scan_options(command, *options);
  command.callback([&chosen, options] { chosen = [options] { return print_requests(*options); }; });
}

}  // namespace binpose::client::cli

#include <malloc.h>

#include <cstdlib>
#include <iostream>

#include "client/cli/command.h"

namespace binpose::client::cli {
namespace {

constexpr const char* kFooter = R"(
Examples:
  binpose train --id gear --mesh gear.stl --unit mm
  binpose detect --model gear --scene bin.ply --unit mm
  binpose detect --model gear --scene bin.ply --unit mm --view result.html
  binpose detect --model gear bolt --scene scan_1/ scan_2/ --unit mm --json
  binpose watch --model gear --dir scans/ --unit mm
  binpose request --model gear --scene bin.pcd --unit m | grpcurl -plaintext -d @ localhost:50051 \
      binpose.v1.DetectionService/Detect

`binpose COMMAND --help` has the examples of a command.

Exit codes: 0 done; 1 refused by the server, or a scene failed; 2 wrong usage; 3 a file cannot be read;
4 no server, or no answer in time.)";

/// What gRPC writes to stderr of its own accord says nothing that our errors do not; who wants it sets the variable.
void silence_grpc() { ::setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0); }

/// Keeps the memory of a scan for the next one: to have it from the system anew costs more than to send the scan.
void keep_memory_of_scans() {
  constexpr int kMiB = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMiB);
  mallopt(M_TRIM_THRESHOLD, 64 * kMiB);
}

/// What a subcommand did not foresee ends here, as a sentence: a library that throws, memory that runs out.
int run(int argc, char** argv) {
  silence_grpc();
  keep_memory_of_scans();
  CLI::App app("Finds trained parts in point clouds: the command-line client of binpose-server.", "binpose");
  app.footer(kFooter);
  app.require_subcommand(1);
  app.fallthrough();
  GlobalOptions global;
  app.add_option("--server", global.server,
                 "Address of the server, HOST:PORT; of several with commas between, the next where one is lost")
      ->envname("BINPOSE_SERVER")
      ->capture_default_str();
  app.add_option("--retries", global.retries,
                 "Attempts in a row to open a lost stream again and send what was not answered; 0: none")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000));
  app.add_flag("--json", global.json, "Print the answers as JSON, one object per line");
  app.add_option("--timeout", global.timeout_seconds, "Seconds to wait for an answer; for a training: for all of it")
      ->check(CLI::Range(0.001, 1e6));
  app.add_option("--tls-ca", global.tls_ca, "PEM file of the authorities that vouch for the server; else plaintext");
  app.add_option("--tls-cert", global.tls_cert, "PEM file of the certificate that the server asks for");
  app.add_option("--tls-key", global.tls_key, "PEM file of its key");
  app.add_option("--token-file", global.token_file, "File whose first line is the bearer token")
      ->envname("BINPOSE_CLIENT_TOKEN_FILE");
  Command chosen;
  add_train(app, global, chosen);
  add_detect(app, global, chosen);
  add_models(app, global, chosen);
  add_model(app, global, chosen);
  add_delete(app, global, chosen);
  add_export(app, global, chosen);
  add_import(app, global, chosen);
  add_watch(app, global, chosen);
  add_bench(app, global, chosen);
  add_health(app, global, chosen);
  add_request(app, global, chosen);
  add_completion(app, global, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }
  try {
    return chosen();
  } catch (const CLI::RuntimeError& error) {
    return error.get_exit_code();
  }
}

}  // namespace
}  // namespace binpose::client::cli

int main(int argc, char** argv) {
  try {
    return binpose::client::cli::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "binpose: " << error.what() << std::endl;
    return binpose::client::cli::kRefused;
  }
}

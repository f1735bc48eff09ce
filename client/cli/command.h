#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client/client.h"

/// The subcommands of `binpose`, one file each: add_<name>() declares the options and, when the user chose it, puts
/// what is to be done into `chosen`.
namespace binpose::client::cli {

/// What every subcommand heeds.
struct GlobalOptions {
  std::string server = "localhost:50051";
  bool json = false;
  std::optional<double> timeout_seconds;
  std::string tls_ca;
  std::string tls_cert;
  std::string tls_key;
  std::string token_file;
  int retries = Retries().attempts;
};

/// What the shell gets to see.
enum ExitCode : int {
  kOk = 0,
  kRefused = 1,      ///< the server refused the request, or one of several scenes failed
  kUsage = 2,        ///< the command line makes no sense
  kUnreadable = 3,   ///< a file cannot be read
  kUnreachable = 4,  ///< no server, or no answer in time
};

using Command = std::function<ExitCode()>;

void add_train(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_detect(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_models(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_model(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_delete(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_export(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_import(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_bench(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_watch(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_health(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_request(CLI::App& app, const GlobalOptions& global, Command& chosen);
void add_completion(CLI::App& app, const GlobalOptions& global, Command& chosen);

/// A client for the server that the user named. Throws CLI::RuntimeError when a file of certificates or the token
/// cannot be read.
Client connect(const GlobalOptions& global);

/// Prints "binpose: <sentence>" to standard error.
void report(const absl::Status& error);

/// Reports the error of a call and says how to exit.
ExitCode report_call(const absl::Status& error);

}  // namespace binpose::client::cli

#include <chrono>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <memory>
#include <thread>

#include "client/call_error.h"
#include "client/cli/answer_text.h"
#include "client/cli/command.h"
#include "client/cli/folder.h"
#include "client/cli/json.h"
#include "client/cli/scan_options.h"

namespace binpose::client::cli {
namespace {

struct WatchOptions {
  ScanOptions scan;
  std::string folder;
  bool takes_existing = false;
  std::uint64_t count = 0;
  double interval = 0.2;
};

volatile std::sig_atomic_t is_interrupted = 0;

void on_signal(int /*signal*/) { is_interrupted = 1; }

/// Searches scans one by one; keeps its stream, and opens another after a fault.
class Searcher {
 public:
  Searcher(const WatchOptions& options, const GlobalOptions& global)
      : options_(options), json_(global.json), client_(connect(global)) {}

  /// Whether the scan was dealt with: answered, or not worth another try.
  bool search(const std::filesystem::path& file) {
    absl::StatusOr<v1::DetectRequest> request = make_request(options_.scan, file.string());
    if (!request.ok()) {
      say(request.status());
      return true;
    }
    if (stream_ == nullptr) stream_ = client_.open_detect_stream();
    std::optional<v1::DetectResponse> answer;
    if (stream_->write(*std::move(request)).ok()) answer = stream_->read();
    if (!answer.has_value()) {
      const absl::Status fault = stream_->finish();
      stream_.reset();
      say(fault);
      return false;
    }
    last_fault_.clear();
    show(*answer, file.string());
    return true;
  }

 private:
  void show(const v1::DetectResponse& answer, const std::string& file) const {
    const absl::Status error = frame_error(answer);
    if (!error.ok()) report({error.code(), file + ": " + std::string(error.message())});
    if (json_) {
      std::cout << answer_json(answer) << std::endl;
    } else if (error.ok()) {
      print_answer(answer, file, options_.scan.unit);
    }
  }

  /// Reports a fault once, however long it lasts.
  void say(const absl::Status& fault) {
    if (last_fault_ == fault.message()) return;
    last_fault_ = std::string(fault.message());
    report(fault);
  }

  const WatchOptions& options_;
  const bool json_;
  Client client_;
  std::unique_ptr<DetectStream> stream_;
  std::string last_fault_;
};

std::set<std::string> scan_endings(const ScanOptions& scan) {
  if (scan.camera.has_value()) return {".png", ".pgm"};
  return {".ply", ".pcd"};
}

ExitCode watch(const WatchOptions& options, const GlobalOptions& global) {
  std::error_code error;
  if (!std::filesystem::is_directory(options.folder, error)) {
    report(absl::NotFoundError("There is no folder " + options.folder + " to watch."));
    return kUnreadable;
  }
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  Folder folder(options.folder, scan_endings(options.scan));
  if (!options.takes_existing) folder.skip();
  Searcher searcher(options, global);
  for (std::uint64_t done = 0; is_interrupted == 0 && (options.count == 0 || done < options.count);) {
    for (const std::filesystem::path& file : folder.look()) {
      if (is_interrupted != 0 || (options.count > 0 && done == options.count)) break;
      if (searcher.search(file)) {
        ++done;
      } else {
        folder.put_back(file);
      }
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(options.interval));
  }
  return kOk;
}

}  // namespace

void add_watch(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  const auto options = std::make_shared<WatchOptions>();
  CLI::App& command = *app.add_subcommand("watch", "Find parts in each new scan that appears in a folder");
  command.footer(R"(
Takes PLY and PCD files, or with --camera depth images (PNG, PGM), once they are complete. Where the server cannot be
reached, the scan waits for it. Ctrl-C ends.

Examples:
  binpose watch --model gear --dir /mnt/scanner --unit mm
  binpose watch --model gear --dir /mnt/scanner --camera camera.json --unit mm --json | ./send-to-robot)");
  command.add_option("--dir", options->folder, "Folder to watch")->required()->type_name("FOLDER");
  add_search_options(command, options->scan);
  command.add_flag("--existing", options->takes_existing, "Begin with the scans that are there already");
  command.add_option("--count", options->count, "End after this many scans; 0: never")->capture_default_str();
  command.add_option("--interval", options->interval, "Seconds between two looks at the folder")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 3600.0));
  command.callback([&chosen, options, &global] { chosen = [options, &global] { return watch(*options, global); }; });
}

}  // namespace binpose::client::cli

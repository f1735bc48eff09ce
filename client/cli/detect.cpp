#include <atomic>
#include <future>
#include <iostream>
#include <memory>
#include <thread>

#include "client/call_error.h"
#include "client/cli/answer_text.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/progress.h"
#include "client/cli/result_page.h"
#include "client/cli/scan_options.h"
#include "client/cli/style.h"

namespace binpose::client::cli {
namespace {

/// Writes the scenes to the stream in a thread of its own, and tells of each in turn whether it could be read.
class SceneWriter {
 public:
  SceneWriter(const ScanOptions& options, DetectStream& stream)
      : reads_(options.scenes.size()), thread_([this, &options, &stream] { write_all(options, stream); }) {}

  ~SceneWriter() {
    is_stopped_ = true;
    thread_.join();
  }

  SceneWriter(const SceneWriter&) = delete;
  SceneWriter& operator=(const SceneWriter&) = delete;

  /// OK once scene `i` is on its way, or why its file cannot be read. To be called once for each, in order.
  absl::Status wait_for(std::size_t i) { return reads_[i].get_future().get(); }

 private:
  void write_all(const ScanOptions& options, DetectStream& stream) {
    for (std::size_t i = 0; i < reads_.size() && !is_stopped_; ++i) {
      absl::StatusOr<v1::DetectRequest> request = make_request(options, options.scenes[i]);
      reads_[i].set_value(request.status());
      // Where writing fails the stream has ended; whoever reads its answers will see.
      if (request.ok() && !stream.write(*std::move(request)).ok()) return;
    }
    stream.done_writing();
  }

  std::atomic<bool> is_stopped_ = false;
  std::vector<std::promise<absl::Status>> reads_;
  std::thread thread_;
};

/// An answer that never went over the wire, so that --json has one line for every scene.
v1::DetectResponse local_answer(const std::string& scene, const absl::Status& error) {
  v1::DetectResponse answer;
  answer.set_request_id(request_id_of(scene));
  answer.mutable_error()->set_code(static_cast<int>(error.code()));
  answer.mutable_error()->set_message(std::string(error.message()));
  return answer;
}

/// Prints the answer of each scene as it comes; says how the first scene that failed did so.
ExitCode exchange(const ScanOptions& options, bool json, DetectStream& stream) {
  ExitCode exit_code = kOk;
  const auto fail = [&](const std::string& scene, const absl::Status& error, ExitCode code) {
    report({error.code(), scene + ": " + std::string(error.message())});
    if (exit_code == kOk) exit_code = code;
  };
  // Answers on a terminal are progress enough.
  const bool has_bar = options.scenes.size() > 1 && is_terminal(stderr) && !is_terminal(stdout);
  SceneWriter writer(options, stream);
  for (std::size_t i = 0; i < options.scenes.size(); ++i) {
    const std::string& scene = options.scenes[i];
    const absl::Status unread = writer.wait_for(i);
    const std::optional<v1::DetectResponse> answer = unread.ok() ? stream.read() : local_answer(scene, unread);
    if (!answer.has_value()) break;
    const absl::Status error = frame_error(*answer);
    if (!error.ok()) fail(scene, error, unread.ok() ? kRefused : kUnreadable);
    if (json) {
      std::cout << answer_json(*answer) << std::endl;
    } else if (error.ok()) {
      print_answer(*answer, scene, options.unit);
    }
    if (has_bar) draw_progress(static_cast<double>(i + 1) / static_cast<double>(options.scenes.size()), scene);
  }
  if (has_bar) clear_progress();
  return exit_code;
}

/// Searches the one scene and draws what was found.
ExitCode detect_and_draw(const ScanOptions& options, const ResultPageOptions& drawing, bool json, Client& client) {
  const std::string& scene = options.scenes.front();
  absl::StatusOr<v1::DetectRequest> request = make_request(options, scene);
  if (!request.ok()) {
    report(request.status());
    return kUnreadable;
  }
  if (!options.max_rejected.has_value()) request->mutable_params()->set_max_rejected(kRejectedOnPage);
  const Scan scan = std::make_shared<const v1::DetectRequest>(*std::move(request));
  const absl::StatusOr<v1::DetectResponse> answer = client.detect(scan);
  if (!answer.ok()) return report_call({answer.status().code(), scene + ": " + std::string(answer.status().message())});
  if (json) {
    std::cout << answer_json(*answer) << std::endl;
  } else {
    print_answer(*answer, scene, options.unit);
  }
  if (absl::Status status = write_result_page(drawing, *scan, *answer, client); !status.ok()) {
    report(status);
    return kUnreadable;
  }
  if (!json) std::cout << "drawn in " << *drawing.page << '\n';
  return kOk;
}

ExitCode detect(const ScanOptions& options, const ResultPageOptions& drawing, const GlobalOptions& global) {
  Client client = connect(global);
  if (drawing.page.has_value()) return detect_and_draw(options, drawing, global.json, client);
  const std::unique_ptr<DetectStream> stream = client.open_detect_stream();
  const ExitCode exit_code = exchange(options, global.json, *stream);
  if (absl::Status status = stream->finish(); !status.ok()) return report_call(status);
  return exit_code;
}

}  // namespace

void add_detect(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  const auto options = std::make_shared<ScanOptions>();
  const auto drawing = std::make_shared<ResultPageOptions>();
  CLI::App& command = *app.add_subcommand("detect", "Find parts in scenes; all scenes go over one stream, in order");
  command.footer(
      "\nA pose maps the part's CAD frame to the scene's frame: position in mm, R = Rz(yaw) Ry(pitch) Rx(roll) in "
      "degrees.\n\n"
      "Examples:\n"
      "  binpose detect --model gear --scene bin.ply --unit mm\n"
      "  binpose detect --model gear --scene depth.png --camera camera.json --unit mm\n"
      "  binpose detect --model gear --scene bin.ply --unit mm --view result.html --mesh gear.stl --mesh-unit mm\n"
      "  binpose detect --model gear bolt --scene scan_*/ --unit mm --json | jq .hypotheses[0].pose");
  add_scan_options(command, *options);
  add_result_page_options(command, *drawing);
  command.callback([&chosen, options, drawing, &global] {
    if (drawing->page.has_value() && options->scenes.size() > 1) {
      throw CLI::ValidationError("--view", "draws one scene; " + std::to_string(options->scenes.size()) + " are given");
    }
    if (drawing->meshes.size() > options->model_ids.size()) {
      throw CLI::ValidationError("--mesh", "takes one file for each --model, in the same order");
    }
    chosen = [options, drawing, &global] { return detect(*options, *drawing, global); };
  });
}

}  // namespace binpose::client::cli

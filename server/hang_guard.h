#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "server/clock.h"
#include "server/status.h"

namespace binpose::server {

/// For how long a directory that does not answer may keep a caller waiting.
inline constexpr std::chrono::seconds kDirectoryPatience(5);

/// Keeps callers from hanging with a directory: a call into a share that is away may return only when it is back, and
/// who detects from memory needs the caller's thread. Its destructor waits for the calls that still hang.
class HangGuard {
 public:
  /// @param answers  whether the directory is there; it may hang, and is asked twice a second.
  HangGuard(std::filesystem::path directory, std::function<bool()> answers)
      : directory_(std::move(directory)),
        asker_([this, answers = std::move(answers)](const std::stop_token& stop) { ask(answers, stop); }) {}

  void note_answer() { last_answer_ = Clock::now(); }
  /// Seconds since the directory last answered.
  double age() const { return seconds_since(last_answer_); }

  /// What `work` on the directory returns, a Status or StatusOr, or UNAVAILABLE when the directory does not answer; the
  /// work then goes on without a caller, so it owns what it uses, but for what outlives the guard.
  template <class Work>
  auto run(Work work) -> decltype(work()) {
    using Result = decltype(work());
    if (absl::Status status = check_answers(); !status.ok()) return status;
    const auto result = std::make_shared<Result>(absl::UnknownError(""));
    std::future<void> end = std::async(
        std::launch::async, [result, work = std::move(work)] { *result = contain_exceptions([&] { return work(); }); });
    while (end.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
      absl::Status status = check_answers();
      if (status.ok()) continue;
      abandon(std::move(end));
      return status;
    }
    return *std::move(result);
  }

 private:
  /// In a thread of its own, so that a slow disk that takes or gives a model is not taken for one that hangs.
  void ask(const std::function<bool()>& answers, const std::stop_token& stop) {
    constexpr std::chrono::milliseconds kInterval(500);
    std::mutex mutex;
    std::condition_variable_any wake;
    std::unique_lock lock(mutex);
    while (!wake.wait_for(lock, stop, kInterval, [&stop] { return stop.stop_requested(); })) {
      if (answers()) note_answer();
    }
  }

  absl::Status check_answers() const {
    if (age() < std::chrono::duration<double>(kDirectoryPatience).count()) return absl::OkStatus();
    return absl::UnavailableError(
        absl::StrFormat("The model directory %s has not answered for %.0f s.", directory_.string(), age()));
  }

  void abandon(std::future<void> call) {
    const std::lock_guard lock(mutex_);
    std::erase_if(abandoned_, [](const auto& other) {
      return other.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    abandoned_.push_back(std::move(call));
  }

  const std::filesystem::path directory_;
  std::atomic<Clock::time_point> last_answer_ = Clock::now();
  std::mutex mutex_;
  std::vector<std::future<void>> abandoned_;  ///< still under way when they were last looked at
  std::jthread asker_;                        ///< last, so that it ends before the rest goes
};

}  // namespace binpose::server

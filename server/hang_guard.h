#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/clock.h"
#include "server/status.h"

namespace binpose::server {

/// For how long a directory that does not answer may keep a caller waiting.
inline constexpr std::chrono::seconds kDirectoryPatience(5);

/// Keeps callers from hanging with a directory: a call into a share that is away may return only when it is back, and
/// who detects from memory needs the caller's thread. Logs once that the directory is away, and once that it is back.
/// Its destructor waits for the calls that still hang.
class HangGuard {
 public:
  struct Times {
    std::chrono::milliseconds patience = kDirectoryPatience;   ///< a directory that is silent for longer is away
    std::chrono::milliseconds rest = std::chrono::minutes(1);  ///< at least, between two times that it is told away
  };

  /// @param answers  whether the directory is there; it may hang, and is asked ten times in a patience.
  HangGuard(std::filesystem::path directory, std::function<bool()> answers)
      : HangGuard(std::move(directory), std::move(answers), Times()) {}
  HangGuard(std::filesystem::path directory, std::function<bool()> answers, const Times& times);

  /// The directory was read as it should be.
  void note_answer();
  /// It answered, but not as a model directory: it is away until note_answer().
  void note_fault(const absl::Status& fault);
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
  void ask(const std::function<bool()>& answers, const std::stop_token& stop);
  void tell(const std::stop_token& stop);
  bool is_silent() const { return age() > std::chrono::duration<double>(times_.patience).count(); }
  absl::Status check_answers() const;
  absl::Status fault() const;
  void abandon(std::future<void> call);

  const std::filesystem::path directory_;
  const Times times_;
  std::atomic<Clock::time_point> last_answer_ = Clock::now();
  mutable std::mutex mutex_;                  ///< guards what follows
  absl::Status fault_;                        ///< that was noted last, if no answer was noted since
  std::vector<std::future<void>> abandoned_;  ///< still under way when they were last looked at
  std::jthread asker_;                        ///< in threads of their own, since it may hang; last, so that they end
  std::jthread teller_;                       ///< before the rest goes
};

}  // namespace binpose::server

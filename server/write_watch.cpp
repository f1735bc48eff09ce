#include "server/write_watch.h"

#include <algorithm>
#include <condition_variable>

#include "absl/strings/str_format.h"
#include "server/log.h"

namespace binpose::server {

WriteWatch::WriteWatch(std::chrono::milliseconds patience)
    : patience_(patience), watcher_([this](const std::stop_token& stop) { watch(stop); }) {}

void WriteWatch::begin(grpc::CallbackServerContext& call) {
  const std::lock_guard lock(mutex_);
  since_[&call] = Clock::now();
}

void WriteWatch::end(grpc::CallbackServerContext& call) {
  const std::lock_guard lock(mutex_);
  since_.erase(&call);
}

void WriteWatch::watch(const std::stop_token& stop) {
  const auto interval = std::min<std::chrono::milliseconds>(patience_ / 4, std::chrono::seconds(1));
  std::condition_variable_any wake;
  std::unique_lock lock(mutex_);
  while (!wake.wait_for(lock, stop, interval, [&stop] { return stop.stop_requested(); })) {
    std::erase_if(since_, [&](const auto& write) {
      if (Clock::now() - write.second < patience_) return false;
      log_failure("a call", absl::DeadlineExceededError(absl::StrFormat(
                                "%s took no message for %d s.", write.first->peer(), patience_.count() / 1000)));
      write.first->TryCancel();  // the write under way keeps the call until its end is told, on another thread
      return true;
    });
  }
}

}  // namespace binpose::server

#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

namespace binpose::server {

/// What a call is told, with UNAVAILABLE, that comes or stays while the server drains.
inline constexpr const char* kEnding = "The server is about to end; try again later or elsewhere.";

/// Lets the server end without cutting a call short: tells the calls that the end is near and waits for the last.
class Drain {
 public:
  /// Held by each call from start to end.
  class Call {
   public:
    explicit Call(Drain& drain) : drain_(drain) { drain_.add(1); }
    ~Call() {
      action_.reset();  // waits for an action that runs just now
      drain_.add(-1);
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    /// Calls `action` once, when draining starts or at once if it has; never again after ~Call().
    void when_draining(std::function<void()> action) { action_.emplace(drain_.source_.get_token(), std::move(action)); }

   private:
    Drain& drain_;
    std::optional<std::stop_callback<std::function<void()>>> action_;
  };

  void start() { source_.request_stop(); }
  bool started() const { return source_.stop_requested(); }

  /// Waits until no call is left; false when `timeout` came first.
  bool wait_for_calls(std::chrono::seconds timeout);

 private:
  void add(int calls);

  std::stop_source source_;
  std::mutex mutex_;
  std::condition_variable none_left_;
  int calls_ = 0;
};

}  // namespace binpose::server

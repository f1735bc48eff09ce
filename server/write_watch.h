#pragma once

#include <grpcpp/server_context.h>

#include <chrono>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>

#include "server/clock.h"

namespace binpose::server {

/// Cancels the calls of callers that do not take what they asked for: one that answers pings but reads nothing would
/// hold its call, and what waits in it, for ever. Thread-safe.
class WriteWatch {
 public:
  /// @param patience  how long a message may stay untaken.
  explicit WriteWatch(std::chrono::milliseconds patience);

  /// A write begins; end() must follow while the call is still there.
  void begin(grpc::CallbackServerContext& call);
  void end(grpc::CallbackServerContext& call);

 private:
  void watch(const std::stop_token& stop);

  const std::chrono::milliseconds patience_;
  std::mutex mutex_;
  std::map<grpc::CallbackServerContext*, Clock::time_point> since_;  ///< of the writes under way
  std::jthread watcher_;                                             ///< last, so that it ends before the rest goes
};

}  // namespace binpose::server

#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"

namespace binpose::server {

/// Threads that compute, with a bounded queue before them: gRPC's own few threads must never be kept waiting.
class ComputePool {
 public:
  using Task = std::function<void()>;

  /// @param work            what waits here, in the plural, for the error message: "detections".
  /// @param threads         >= 1.
  /// @param queue_capacity  tasks that may wait.
  ComputePool(std::string work, int threads, std::size_t queue_capacity);
  /// Runs what still waits, then ends the threads.
  ~ComputePool();
  ComputePool(const ComputePool&) = delete;
  ComputePool& operator=(const ComputePool&) = delete;

  /// Queues a task, first come first served; it must not throw. Never blocks. Errors: RESOURCE_EXHAUSTED (queue full).
  absl::Status submit(Task task);

  /// Threads that one task may use now, so that all that run and wait get an equal share; >= 1.
  int fair_share() const;

 private:
  void run_tasks();

  const std::string work_;
  const std::size_t queue_capacity_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> queue_;
  std::size_t running_ = 0;
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace binpose::server

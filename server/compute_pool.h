#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/clock.h"

namespace binpose::server {

/// Threads that compute, with a bounded queue before them: gRPC's own few threads must never be kept waiting.
class ComputePool {
 public:
  using Task = std::function<void()>;

  /// Who waits for a task.
  struct Caller {
    std::stop_token stop = {};                       ///< stopped: the task only has to end
    std::optional<Clock::time_point> deadline = {};  ///< when its result is worth nothing any more
  };

  enum class Priority { kNormal, kLow };

  /// @param work            what waits here, in the plural, for the error message: "detections".
  /// @param threads         >= 1.
  /// @param queue_capacity  tasks that may wait.
  /// @param priority        kLow: the threads get what those of normal priority leave.
  ComputePool(std::string work, int threads, std::size_t queue_capacity, Priority priority = Priority::kNormal);
  /// Runs what still waits, then ends the threads.
  ~ComputePool();
  ComputePool(const ComputePool&) = delete;
  ComputePool& operator=(const ComputePool&) = delete;

  /// Queues a task, first come first served; it must not throw. Never blocks. Errors: RESOURCE_EXHAUSTED, made by
  /// refused(): the queue is full, or so long that the task would end after its deadline.
  absl::Status submit(Task task, Caller caller);
  absl::Status submit(Task task) { return submit(std::move(task), Caller()); }

  /// Runs those waiting tasks whose caller has gone, on this thread: they free their places at once.
  void run_stopped();

  /// Threads that one task may use now, so that all that run and wait get an equal share; >= 1.
  int fair_share() const;
  /// Tasks that wait.
  std::size_t waiting() const;

 private:
  struct Waiting {
    Task task;
    Caller caller;
  };

  absl::Status admit(const Caller& caller) const;
  void run_tasks(Priority priority);

  const std::string work_;
  const std::size_t queue_capacity_;
  const std::size_t thread_count_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Waiting> queue_;
  std::size_t running_ = 0;
  double task_seconds_ = 0;  ///< mean of the last tasks
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace binpose::server

#include "server/compute_pool.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "absl/strings/str_format.h"
#include "server/refusal.h"

namespace binpose::server {

ComputePool::ComputePool(std::string work, int threads, std::size_t queue_capacity, Priority priority)
    : work_(std::move(work)), queue_capacity_(queue_capacity), thread_count_(static_cast<std::size_t>(threads)) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this, priority] { run_tasks(priority); });
}

ComputePool::~ComputePool() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

absl::Status ComputePool::submit(Task task, Caller caller) {
  {
    const std::lock_guard lock(mutex_);
    if (absl::Status status = admit(caller); !status.ok()) return status;
    queue_.push_back({std::move(task), std::move(caller)});
  }
  wake_.notify_one();
  return absl::OkStatus();
}

absl::Status ComputePool::admit(const Caller& caller) const {
  const std::size_t before = queue_.size() + running_;
  if (before < thread_count_) return absl::OkStatus();  // a deadline that is near gives the best so far
  const double turn_seconds = task_seconds_ / static_cast<double>(thread_count_);
  const double wait_seconds = static_cast<double>(before - thread_count_ + 1) * turn_seconds;
  if (queue_.size() >= queue_capacity_) {
    return refused(Refusal::kQueueFull,
                   absl::StrFormat("The server is full: %d %s wait already; try again later.", queue_.size(), work_),
                   wait_seconds / 2);
  }
  if (!caller.deadline) return absl::OkStatus();
  const double left = std::chrono::duration<double>(*caller.deadline - Clock::now()).count();
  if (wait_seconds + task_seconds_ <= left) return absl::OkStatus();
  return refused(Refusal::kDeadline,
                 absl::StrFormat("The server is busy: of %s, %d wait already, and this one would end in about %.2f s, "
                                 "while its deadline is in %.2f s; try again later.",
                                 work_, queue_.size(), wait_seconds + task_seconds_, std::max(0.0, left)),
                 wait_seconds);
}

void ComputePool::run_stopped() {
  std::deque<Waiting> stopped;
  {
    const std::lock_guard lock(mutex_);
    const auto first = std::stable_partition(
        queue_.begin(), queue_.end(), [](const Waiting& waiting) { return !waiting.caller.stop.stop_requested(); });
    std::move(first, queue_.end(), std::back_inserter(stopped));
    queue_.erase(first, queue_.end());
  }
  for (Waiting& waiting : stopped) waiting.task();
}

int ComputePool::fair_share() const {
  const std::lock_guard lock(mutex_);
  const std::size_t tasks = std::max<std::size_t>(1, running_ + queue_.size());
  return static_cast<int>(std::max<std::size_t>(1, thread_count_ / tasks));
}

std::size_t ComputePool::waiting() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

void ComputePool::run_tasks(Priority priority) {
  constexpr int kNicest = 19;
  // On Linux a thread has a priority of its own; it need not be allowed to matter.
  if (priority == Priority::kLow) ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNicest);
  constexpr double kNewest = 0.2;  // weight of the last task in the mean
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return closing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    Waiting next = std::move(queue_.front());
    queue_.pop_front();
    ++running_;
    lock.unlock();
    const Clock::time_point start = Clock::now();
    next.task();
    next.task = nullptr;  // what it holds goes before the next wait
    const double seconds = seconds_since(start);
    lock.lock();
    --running_;
    task_seconds_ = task_seconds_ == 0 ? seconds : (1 - kNewest) * task_seconds_ + kNewest * seconds;
  }
}

}  // namespace binpose::server

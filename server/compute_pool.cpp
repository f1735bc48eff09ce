#include "server/compute_pool.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"

namespace binpose::server {

ComputePool::ComputePool(std::string work, int threads, std::size_t queue_capacity)
    : work_(std::move(work)), queue_capacity_(queue_capacity) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { run_tasks(); });
}

ComputePool::~ComputePool() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

absl::Status ComputePool::submit(Task task) {
  {
    const std::lock_guard lock(mutex_);
    if (queue_.size() >= queue_capacity_) {
      return absl::ResourceExhaustedError(
          absl::StrFormat("The server is full: %d %s wait already; try again later.", queue_.size(), work_));
    }
    queue_.push_back(std::move(task));
  }
  wake_.notify_one();
  return absl::OkStatus();
}

int ComputePool::fair_share() const {
  const std::lock_guard lock(mutex_);
  const std::size_t tasks = std::max<std::size_t>(1, running_ + queue_.size());
  return static_cast<int>(std::max<std::size_t>(1, threads_.size() / tasks));
}

void ComputePool::run_tasks() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return closing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    Task task = std::move(queue_.front());
    queue_.pop_front();
    ++running_;
    lock.unlock();
    task();
    task = nullptr;  // what it holds goes before the next wait
    lock.lock();
    --running_;
  }
}

}  // namespace binpose::server

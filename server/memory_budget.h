#pragma once

#include <atomic>
#include <cstddef>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace binpose::server {

/// Bytes of requests: how many may be held at a time, and how many one message may have. Thread-safe.
class MemoryBudget {
 public:
  /// A part of the budget, given back when it goes.
  class Share {
   public:
    Share() = default;
    Share(MemoryBudget& budget, std::size_t bytes) : budget_(&budget), bytes_(bytes) {}
    Share(Share&& other) noexcept : budget_(std::exchange(other.budget_, nullptr)), bytes_(other.bytes_) {}
    Share& operator=(Share&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    /// Takes what `other` holds of the same budget.
    void add(Share other) {
      budget_ = other.budget_;
      bytes_ += std::exchange(other.bytes_, 0);
    }
    ~Share() {
      if (budget_ != nullptr) budget_->used_ -= bytes_;
    }

   private:
    MemoryBudget* budget_ = nullptr;
    std::size_t bytes_ = 0;
  };

  MemoryBudget(std::size_t limit, std::size_t message_limit) : limit_(limit), message_limit_(message_limit) {}

  /// What a message of that size needs. Errors, each naming size, limit and option: RESOURCE_EXHAUSTED (a message that
  /// is too large; or refused(), with the bytes in use, when there is no room now).
  absl::StatusOr<Share> take(std::size_t bytes);
  std::size_t used() const { return used_; }

 private:
  const std::size_t limit_;
  const std::size_t message_limit_;
  std::atomic<std::size_t> used_ = 0;
};

}  // namespace binpose::server

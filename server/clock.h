#pragma once

#include <chrono>
#include <optional>

namespace binpose::server {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// When core must be done with a call that ends at `deadline`, early enough for the answer to arrive; none when the
/// caller set no deadline.
inline std::optional<Clock::time_point> compute_deadline(std::chrono::system_clock::time_point deadline) {
  constexpr std::chrono::milliseconds kTimeToAnswer(20);
  constexpr std::chrono::hours kForEver(24 * 365);
  const auto left = deadline - std::chrono::system_clock::now();
  if (left > kForEver) return std::nullopt;
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(left) - kTimeToAnswer;
}

}  // namespace binpose::server

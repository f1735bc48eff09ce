#pragma once

#include <chrono>
#include <optional>
#include <stop_token>

namespace binpose {

/// When a computation should end early, and how many threads it may use. Results never depend on `threads`.
struct RunControl {
  std::stop_token stop;  ///< polled; a stop ends the call with CANCELLED within milliseconds
  /// Training: DEADLINE_EXCEEDED. Detection: the best hypotheses so far, marked StopReason::kDeadline.
  std::optional<std::chrono::steady_clock::time_point> deadline;
  int threads = 1;  ///< >= 1
};

}  // namespace binpose

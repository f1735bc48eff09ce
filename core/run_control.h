#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <stop_token>

#include "absl/status/status.h"

namespace binpose {

/// When a computation should end early, and how many threads it may use. Results never depend on `threads`.
struct RunControl {
  std::stop_token stop = {};  ///< polled; a stop ends the call with CANCELLED within milliseconds
  /// Training: DEADLINE_EXCEEDED. Detection: the best hypotheses so far, marked StopReason::kDeadline.
  std::optional<std::chrono::steady_clock::time_point> deadline = {};
  int threads = 1;  ///< >= 1

  bool past_deadline() const { return deadline && std::chrono::steady_clock::now() >= *deadline; }
  /// Nobody waits for the rest.
  bool interrupted() const { return stop.stop_requested() || past_deadline(); }
  /// The same for loops of steps below a microsecond: looks at every 1024th step only.
  bool interrupted_at(std::size_t step) const { return step % 1024 == 0 && interrupted(); }
  /// For a stage that may take a share of the time that is left, so that something is left for the stages after it.
  RunControl with_share_of_time(double share) const {
    RunControl stage = *this;
    const auto now = std::chrono::steady_clock::now();
    if (deadline) {
      stage.deadline = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(share * (*deadline - now));
    }
    return stage;
  }
  /// OK, CANCELLED or DEADLINE_EXCEEDED.
  absl::Status status() const {
    if (stop.stop_requested()) return absl::CancelledError("The caller cancelled the work.");
    if (past_deadline()) return absl::DeadlineExceededError("The deadline passed before the work was done.");
    return absl::OkStatus();
  }
};

}  // namespace binpose

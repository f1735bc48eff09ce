#pragma once

#include <algorithm>
#include <chrono>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "core/run_control.h"

namespace binpose::server {

/// The longest that a mesh or cloud may take to read, so that no file holds a thread.
inline constexpr std::chrono::seconds kMaxDecodeTime(10);

/// What `decode(control)` returns, a StatusOr, within the limit of time.
///
/// Errors: those of `decode`; RESOURCE_EXHAUSTED, naming `field` and the limit.
template <class Decode>
auto decode_in_time(std::string_view field, const RunControl& control, Decode&& decode,
                    std::chrono::seconds limit = kMaxDecodeTime) -> decltype(decode(control)) {
  const auto end = std::chrono::steady_clock::now() + limit;
  RunControl limited = control;
  limited.deadline = std::min(end, control.deadline.value_or(end));
  auto decoded = std::forward<Decode>(decode)(limited);
  if (absl::IsDeadlineExceeded(decoded.status()) && !control.past_deadline()) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("%s takes more than %d s to read; that is the limit. Send fewer points or triangles, or binary "
                        "numbers.",
                        field, limit.count()));
  }
  return decoded;
}

}  // namespace binpose::server

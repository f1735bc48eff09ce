#include "server/memory_budget.h"

#include <cmath>

#include "absl/strings/str_format.h"
#include "server/refusal.h"

namespace binpose::server {
namespace {

double mib(std::size_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

}  // namespace

absl::StatusOr<MemoryBudget::Share> MemoryBudget::take(std::size_t bytes) {
  constexpr double kRetryAfterSeconds = 0.5;
  if (bytes > message_limit_) {
    // Rounded up, so that it is never told to equal the limit.
    return absl::ResourceExhaustedError(absl::StrFormat(
        "The message has %.1f MiB; the server's limit, --max-message-mib, is %.0f. Send less, or raise it.",
        std::ceil(10 * mib(bytes)) / 10, mib(message_limit_)));
  }
  std::size_t used = used_;
  do {
    if (bytes > limit_ - used) {
      return refused(
          Refusal::kMemory,
          absl::StrFormat("The server is full: a request of %.1f MiB would come to %.1f MiB already held, and "
                          "--request-memory-mib is %.0f; try again later.",
                          mib(bytes), mib(used), mib(limit_)),
          kRetryAfterSeconds);
    }
  } while (!used_.compare_exchange_weak(used, used + bytes));
  return Share(*this, bytes);
}

}  // namespace binpose::server

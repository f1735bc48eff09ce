#include "server/memory_budget.h"

#include "absl/strings/str_format.h"
#include "server/refusal.h"

namespace binpose::server {

absl::StatusOr<MemoryBudget::Share> MemoryBudget::take(std::size_t bytes) {
  constexpr double kRetryAfterSeconds = 0.5;
  constexpr double kMiB = 1 << 20;
  std::size_t used = used_;
  do {
    if (bytes > limit_ - used) {
      return refused(
          Refusal::kMemory,
          absl::StrFormat("The server is full: a request of %.1f MiB would come to %.1f MiB already held, and "
                          "--request-memory-mib is %.0f; try again later.",
                          static_cast<double>(bytes) / kMiB, static_cast<double>(used) / kMiB,
                          static_cast<double>(limit_) / kMiB),
          kRetryAfterSeconds);
    }
  } while (!used_.compare_exchange_weak(used, used + bytes));
  return Share(*this, bytes);
}

}  // namespace binpose::server

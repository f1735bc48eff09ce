#pragma once

#include <google/protobuf/duration.pb.h>

#include <optional>
#include <string_view>

#include "absl/status/status.h"
#include "google/rpc/error_details.pb.h"

/// How a server that is full says no.
namespace binpose::server {

enum class Refusal { kQueueFull, kDeadline, kMemory };

/// RESOURCE_EXHAUSTED that tells the caller when to come again.
absl::Status refused(Refusal reason, std::string_view message, double retry_after_seconds);

/// Why refused() made `status`; none when it did not.
std::optional<Refusal> refusal_of(const absl::Status& status);

/// When to come again, if refused() made `status`.
std::optional<google::rpc::RetryInfo> retry_info_of(const absl::Status& status);

}  // namespace binpose::server

#include "server/refusal.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <string>

namespace binpose::server {
namespace {

constexpr const char* kReason = "binpose/refusal";
constexpr const char* kRetryInfo = "type.googleapis.com/google.rpc.RetryInfo";

}  // namespace

absl::Status refused(Refusal reason, std::string_view message, double retry_after_seconds) {
  absl::Status status = absl::ResourceExhaustedError(std::string(message));
  status.SetPayload(kReason, absl::Cord(std::string(1, static_cast<char>(reason))));
  google::rpc::RetryInfo info;
  // At once would only be refused again.
  const double seconds = std::clamp(retry_after_seconds, 0.01, 60.0);
  *info.mutable_retry_delay() =
      google::protobuf::util::TimeUtil::MicrosecondsToDuration(static_cast<std::int64_t>(1e6 * seconds));
  status.SetPayload(kRetryInfo, absl::Cord(info.SerializeAsString()));
  return status;
}

std::optional<Refusal> refusal_of(const absl::Status& status) {
  const auto payload = status.GetPayload(kReason);
  if (!payload) return std::nullopt;
  return static_cast<Refusal>((*payload)[0]);
}

std::optional<google::rpc::RetryInfo> retry_info_of(const absl::Status& status) {
  const auto payload = status.GetPayload(kRetryInfo);
  google::rpc::RetryInfo info;
  if (!payload || !info.ParseFromString(std::string(*payload))) return std::nullopt;
  return info;
}

}  // namespace binpose::server

#include "server/metrics_endpoint.h"

#include <exception>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"

namespace binpose::server {

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::start(
    const std::string& address, const std::shared_ptr<prometheus::Registry>& registry) {
  // A half-open socket holds a thread until the time-out: the library's two would soon be gone.
  const std::vector<std::string> options = {"listening_ports",    address, "num_threads", "8",
                                            "request_timeout_ms", "5000"};
  try {
    auto exposer = std::make_unique<prometheus::Exposer>(options);
    exposer->RegisterCollectable(registry);
    return std::unique_ptr<MetricsEndpoint>(new MetricsEndpoint(std::move(exposer)));
  } catch (const std::exception& error) {
    return absl::UnavailableError(absl::StrFormat("Cannot serve metrics on %s: %s.", address, error.what()));
  }
}

}  // namespace binpose::server

#pragma once

#include <prometheus/exposer.h>
#include <prometheus/registry.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace binpose::server {

/// Serves GET /metrics over HTTP until it is destroyed.
class MetricsEndpoint {
 public:
  /// @param address  HOST:PORT, port 0 = a free one. Errors: UNAVAILABLE (the address cannot be had).
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> start(const std::string& address,
                                                                const std::shared_ptr<prometheus::Registry>& registry);

  int port() const { return exposer_->GetListeningPorts().front(); }

 private:
  explicit MetricsEndpoint(std::unique_ptr<prometheus::Exposer> exposer) : exposer_(std::move(exposer)) {}

  std::unique_ptr<prometheus::Exposer> exposer_;
};

}  // namespace binpose::server

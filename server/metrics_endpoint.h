#pragma once

#include <CivetServer.h>
#include <prometheus/registry.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace binpose::server {

/// Serves over HTTP until it is destroyed: GET /metrics; /healthz, 200 as long as the process answers; /readyz, 200
/// while the server takes calls, else 503.
class MetricsEndpoint {
 public:
  struct Source {
    std::shared_ptr<prometheus::Registry> registry;
    std::function<void()> before_scrape;  ///< brings up to date what is not counted as it happens
    std::function<bool()> is_ready;
    std::function<std::string()> detail;  ///< lines that /readyz adds
  };

  /// @param address  HOST:PORT, port 0 = a free one. Errors: UNAVAILABLE (the address cannot be had).
  static absl::StatusOr<std::unique_ptr<MetricsEndpoint>> start(const std::string& address, const Source& source);

  int port() { return server_->getListeningPorts().front(); }

 private:
  MetricsEndpoint() = default;

  std::vector<std::unique_ptr<CivetHandler>> handlers_;  ///< outlive the server
  std::unique_ptr<CivetServer> server_;
};

/// OK when GET `path` at `address`, HOST:PORT, is answered with 200; UNAVAILABLE.
absl::Status probe(const std::string& address, const std::string& path);

}  // namespace binpose::server

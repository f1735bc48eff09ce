#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "absl/status/status.h"
#include "server/config.h"

namespace binpose::server {

/// OK when certificate and key can be read and belong together, and the authorities can be read; INVALID_ARGUMENT.
absl::Status check_tls_files(const Config& config);

/// How `config` wants the port: plaintext, TLS or mutual TLS. Certificates are read again within a second of their
/// change; calls that run keep theirs.
std::shared_ptr<grpc::ServerCredentials> server_credentials(const Config& config);

}  // namespace binpose::server

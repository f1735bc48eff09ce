#include "server/tls.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/ssl.h>

#include "absl/strings/str_format.h"

namespace binpose::server {
namespace {

absl::Status unusable(const char* option, const std::filesystem::path& file, const char* wanted) {
  return absl::InvalidArgumentError(
      absl::StrFormat("%s %s cannot be used: it must be a readable PEM file of %s.", option, file.string(), wanted));
}

}  // namespace

absl::Status check_tls_files(const Config& config) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  if (SSL_CTX_use_certificate_chain_file(context.get(), config.tls_cert.c_str()) != 1) {
    return unusable("--tls-cert", config.tls_cert, "certificates");
  }
  if (SSL_CTX_use_PrivateKey_file(context.get(), config.tls_key.c_str(), SSL_FILETYPE_PEM) != 1) {
    return unusable("--tls-key", config.tls_key, "the key that belongs to --tls-cert");
  }
  const bool has_ca = !config.tls_client_ca.empty();
  if (has_ca && SSL_CTX_load_verify_locations(context.get(), config.tls_client_ca.c_str(), nullptr) != 1) {
    return unusable("--tls-client-ca", config.tls_client_ca, "certificates");
  }
  return absl::OkStatus();
}

std::shared_ptr<grpc::ServerCredentials> server_credentials(const Config& config) {
  namespace tls = grpc::experimental;
  constexpr unsigned kReloadSeconds = 1;
  if (config.tls_cert.empty()) return grpc::InsecureServerCredentials();
  tls::TlsServerCredentialsOptions options(std::make_shared<tls::FileWatcherCertificateProvider>(
      config.tls_key, config.tls_cert, config.tls_client_ca, kReloadSeconds));
  options.watch_identity_key_cert_pairs();
  if (!config.tls_client_ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return tls::TlsServerCredentials(options);
}

}  // namespace binpose::server

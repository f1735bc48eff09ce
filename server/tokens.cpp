#include "server/tokens.h"

#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <spdlog/spdlog.h>

#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "server/durable_file.h"

namespace binpose::server {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
constexpr std::size_t kMinTokenLength = 16;

std::string digest_of(std::string_view token) {
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

}  // namespace

absl::Status Tokens::load(const std::filesystem::path& file) {
  if (file.empty()) return absl::OkStatus();
  const auto text = read_file(file, kMaxFileBytes);
  if (!text.ok()) return text.status();
  Loaded loaded;
  if (absl::Status status = parse(*text, loaded.roles); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrFormat("%s, %s", file.string(), status.message()));
  }
  std::error_code ignored;
  loaded.changed = std::filesystem::last_write_time(file, ignored);
  const std::lock_guard lock(mutex_);
  file_ = file;
  loaded_ = std::move(loaded);
  return absl::OkStatus();
}

absl::Status Tokens::parse(const std::string& text, std::map<Digest, Role>& roles) {
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    const std::vector<absl::string_view> words = absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty() || absl::StartsWith(words[0], "#")) continue;
    // The token itself must not get into a log.
    if (words.size() != 2 || (words[0] != "detect" && words[0] != "train")) {
      return absl::InvalidArgumentError(
          absl::StrFormat("line %d: it must be 'detect TOKEN' or 'train TOKEN'.", number));
    }
    if (words[1].size() < kMinTokenLength) {
      return absl::InvalidArgumentError(absl::StrFormat("line %d: the token has %d characters; it needs at least %d.",
                                                        number, words[1].size(), kMinTokenLength));
    }
    roles[digest_of({words[1].data(), words[1].size()})] = words[0] == "train" ? Role::kTrain : Role::kDetect;
  }
  return absl::OkStatus();
}

void Tokens::reload_if_changed() const {
  constexpr std::chrono::milliseconds kInterval(500);
  if (Clock::now() - looked_ < kInterval) return;
  looked_ = Clock::now();
  std::error_code error;
  const auto changed = std::filesystem::last_write_time(file_, error);
  if (error || changed == loaded_.changed) return;
  loaded_.changed = changed;
  const auto text = read_file(file_, kMaxFileBytes);
  std::map<Digest, Role> roles;
  const absl::Status status = text.ok() ? parse(*text, roles) : text.status();
  if (status.ok()) {
    loaded_.roles = std::move(roles);
    spdlog::info("read {} tokens from {}", loaded_.roles.size(), file_.string());
  } else {
    spdlog::error("the tokens stay as they were: {}: {}", file_.string(), std::string(status.message()));
  }
}

absl::Status Tokens::check(const grpc::CallbackServerContext& context, Role needed) const {
  const auto found = context.client_metadata().find("authorization");
  if (found == context.client_metadata().end()) return check("", needed);
  return check(std::string_view(found->second.data(), found->second.size()), needed);
}

absl::Status Tokens::check(std::string_view authorization, Role needed) const {
  constexpr std::string_view kScheme = "Bearer ";
  const std::lock_guard lock(mutex_);
  if (file_.empty()) return absl::OkStatus();
  reload_if_changed();
  const std::string digest = authorization.starts_with(kScheme) ? digest_of(authorization.substr(kScheme.size())) : "";
  std::optional<Role> role;
  for (const auto& [known, its_role] : loaded_.roles) {  // all of them, so that the time tells nothing
    if (digest.size() == known.size() && CRYPTO_memcmp(digest.data(), known.data(), known.size()) == 0) role = its_role;
  }
  if (!role) {
    return absl::UnauthenticatedError(
        "The call needs a token that the server knows, in the header 'authorization: Bearer TOKEN'.");
  }
  if (*role < needed) {
    return absl::PermissionDeniedError("The token's role is 'detect'; this call needs one of role 'train'.");
  }
  return absl::OkStatus();
}

}  // namespace binpose::server

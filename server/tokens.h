#pragma once

#include <grpcpp/server_context.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "server/clock.h"

namespace binpose::server {

/// What a caller may do; each role includes those before it.
enum class Role {
  kDetect,  ///< search clouds, read about models
  kTrain,   ///< train, import, export and delete models
};

/// Who may call: bearer tokens in a file, one a line: the role ("detect" or "train"), a blank, the token (at least 16
/// characters). Blank lines and those that start with # are skipped. The file is read again within a second of its
/// change; one that cannot be used leaves the tokens as they were and is logged. Thread-safe.
class Tokens {
 public:
  /// Lets everybody in.
  Tokens() = default;
  /// Reads `file`, unless it is empty: then everybody is let in.
  absl::Status load(const std::filesystem::path& file);

  /// OK, UNAUTHENTICATED (no token, or one that is not in the file) or PERMISSION_DENIED (its role does not suffice).
  absl::Status check(const grpc::CallbackServerContext& context, Role needed) const;
  /// The same for the value of the header "authorization".
  absl::Status check(std::string_view authorization, Role needed) const;

 private:
  using Digest = std::string;  ///< SHA-256: of one length, so that comparing tells nothing about the token
  struct Loaded {
    std::map<Digest, Role> roles;
    std::filesystem::file_time_type changed;
  };

  static absl::Status parse(const std::string& text, std::map<Digest, Role>& roles);
  void reload_if_changed() const;

  std::filesystem::path file_;
  mutable std::mutex mutex_;  ///< guards what follows
  mutable Loaded loaded_;
  mutable Clock::time_point looked_;
};

}  // namespace binpose::server

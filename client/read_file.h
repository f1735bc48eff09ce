#pragma once

#include <filesystem>
#include <string>

#include "absl/status/statusor.h"

namespace binpose::client {

/// The bytes of a file. Errors: NOT_FOUND, INVALID_ARGUMENT (empty, or larger than the 2 GB that a message can carry),
/// UNKNOWN (cannot be read); each names the file.
absl::StatusOr<std::string> read_file(const std::filesystem::path& path);

}  // namespace binpose::client

#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace binpose::client::cli {

/// Adds the option --view, whose help says when this build has no viewer (see client/viewer/CMakeLists.txt).
CLI::Option* add_view(CLI::App& command, std::optional<std::string>& page, const std::string& help);

/// Writes one HTML file that shows `data`, the JSON that client/viewer/main.js reads, and needs no other file and no
/// network. Errors: FAILED_PRECONDITION (built without the viewer), UNKNOWN (the file cannot be written).
absl::Status write_page(const std::filesystem::path& path, std::string_view data);

}  // namespace binpose::client::cli

#pragma once

#include <string>

namespace binpose::server {

/// Sends spdlog's default logger, and protobuf's through it, to standard error.
///
/// @param level  one of spdlog's level names, for example "info".
void log_to_stderr(const std::string& level);

}  // namespace binpose::server

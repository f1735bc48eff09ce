#pragma once

#include <cstdio>
#include <string>

namespace binpose::client::cli {

enum class Colour : int { kRed = 31, kYellow = 33 };

/// Whether people read what goes to `stream`: a terminal.
bool is_terminal(std::FILE* stream);

/// The text in colour when `stream` is a terminal and NO_COLOR is not set, else as it is.
std::string coloured(const std::string& text, Colour colour, std::FILE* stream);

}  // namespace binpose::client::cli

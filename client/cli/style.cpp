#include "client/cli/style.h"

#include <unistd.h>

#include <cstdlib>

namespace binpose::client::cli {

bool is_terminal(std::FILE* stream) { return isatty(fileno(stream)) != 0; }

std::string coloured(const std::string& text, Colour colour, std::FILE* stream) {
  const char* const refusal = std::getenv("NO_COLOR");
  const bool is_refused = refusal != nullptr && *refusal != '\0';
  if (is_refused || !is_terminal(stream)) return text;
  return "\033[" + std::to_string(static_cast<int>(colour)) + "m" + text + "\033[0m";
}

}  // namespace binpose::client::cli

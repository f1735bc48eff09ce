#include "client/cli/page.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "client/viewer/page.h"

namespace binpose::client::cli {
namespace {

constexpr std::string_view kPlaceholder = "{{DATA}}";

/// JSON that cannot end the script element that it stands in.
std::string escaped(std::string_view json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) c == '<' ? text.append("\\u003c") : text.append(1, c);
  return text;
}

}  // namespace

CLI::Option* add_view(CLI::App& command, std::optional<std::string>& page, const std::string& help) {
  const char* const lack = viewer_page().empty() ? " (not in this build: npm could not be reached)" : "";
  return command.add_option("--view", page, help + lack)->type_name("FILE");
}

absl::Status write_page(const std::filesystem::path& path, std::string_view data) {
  const std::string_view page = viewer_page();
  if (page.empty()) {
    return absl::FailedPreconditionError(
        "This binpose was built without the viewer, because npm could not be reached. Build it again where it can.");
  }
  const std::size_t at = page.find(kPlaceholder);
  std::ofstream file(path, std::ios::binary);
  file << page.substr(0, at) << escaped(data) << page.substr(at + kPlaceholder.size());
  file.close();
  if (!file) return absl::UnknownError(path.string() + " cannot be written: " + std::strerror(errno) + ".");
  return absl::OkStatus();
}

}  // namespace binpose::client::cli

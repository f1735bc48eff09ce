#include "client/read_file.h"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

namespace binpose::client {
namespace {

constexpr std::uintmax_t kMaxBytes = 2'000'000'000;

}  // namespace

absl::StatusOr<std::string> read_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return absl::NotFoundError("There is no file " + path.string() + ".");
  if (!std::filesystem::is_regular_file(status)) {
    return absl::InvalidArgumentError(path.string() + " is not a file.");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size == 0) return absl::InvalidArgumentError(path.string() + " is empty.");
  if (!error && size > kMaxBytes) {
    return absl::InvalidArgumentError(path.string() + " has " + std::to_string(size) + " bytes; the limit is " +
                                      std::to_string(kMaxBytes) + ".");
  }
  std::string bytes(error ? 0 : size, '\0');
  std::ifstream file(path, std::ios::binary);
  if (error || !file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    return absl::UnknownError(
        path.string() + " cannot be read: " + (error ? error.message() : std::string(std::strerror(errno))) + ".");
  }
  return bytes;
}

}  // namespace binpose::client

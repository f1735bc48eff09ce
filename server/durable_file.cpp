#include "server/durable_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <vector>

#include "absl/strings/str_format.h"

namespace binpose::server {
namespace {

absl::Status io_error(std::string_view action, const std::filesystem::path& path) {
  return absl::InternalError(absl::StrFormat("Cannot %s %s: %s.", action, path.string(), std::strerror(errno)));
}

/// Closes a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Of a link or symlink that failed.
absl::Status creation_error(const std::filesystem::path& path) {
  if (errno == EEXIST) return absl::AlreadyExistsError(absl::StrFormat("%s is there already.", path.string()));
  return io_error("create", path);
}

/// Whether a link was made after all: NFS reports a failure when the answer was lost and the request repeated. Leaves
/// errno as it was.
bool has_two_names(int fd) {
  const int reason = errno;
  struct stat info {};
  const bool is_linked = ::fstat(fd, &info) == 0 && info.st_nlink == 2;
  errno = reason;
  return is_linked;
}

/// Makes links and removals in a directory last.
absl::Status sync_directory(const std::filesystem::path& directory) {
  const Descriptor fd(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0 || ::fsync(fd.get()) != 0) return io_error("sync directory", directory);
  return absl::OkStatus();
}

}  // namespace

absl::Status create_durably(const std::filesystem::path& directory, const std::string& name, std::string_view bytes) {
  const std::filesystem::path target = directory / name;
  std::string temporary = directory / ("." + name + ".XXXXXX");
  const Descriptor fd(::mkostemp(temporary.data(), O_CLOEXEC));
  if (fd.get() < 0) return io_error("create a temporary file for", target);
  absl::Status status;
  if (!write_all(fd.get(), bytes) || ::fchmod(fd.get(), 0644) != 0 || ::fsync(fd.get()) != 0) {
    status = io_error("write", target);
  } else if (::link(temporary.c_str(), target.c_str()) != 0 && !has_two_names(fd.get())) {
    status = creation_error(target);
  }
  ::unlink(temporary.c_str());
  return status.ok() ? sync_directory(directory) : status;
}

absl::Status link_durably(const std::filesystem::path& directory, const std::string& name, const std::string& target) {
  const std::filesystem::path link = directory / name;
  if (::symlink(target.c_str(), link.c_str()) != 0) return creation_error(link);
  return sync_directory(directory);
}

void remove_leftovers(const std::filesystem::path& directory, std::string_view ending) {
  constexpr std::string_view kRandom = ".XXXXXX";
  const auto oldest = std::filesystem::file_time_type::clock::now() - std::chrono::minutes(10);
  std::vector<std::filesystem::path> leftovers;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (!name.starts_with('.') || name.size() <= kRandom.size()) continue;
    const std::string_view target = std::string_view(name).substr(0, name.size() - kRandom.size());
    const bool is_temporary = target.ends_with(ending) && name[target.size()] == '.';
    std::error_code ignored;
    const auto written = std::filesystem::last_write_time(entry->path(), ignored);
    if (is_temporary && !ignored && written < oldest) leftovers.push_back(entry->path());
  }
  for (const std::filesystem::path& path : leftovers) ::unlink(path.c_str());
}

absl::Status remove_durably(const std::filesystem::path& directory, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const std::filesystem::path target = directory / name;
    if (::unlink(target.c_str()) != 0 && errno != ENOENT) return io_error("remove", target);
  }
  return sync_directory(directory);
}

absl::StatusOr<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  // Non-blocking, so that a FIFO does not hold up the start.
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  struct stat info {};
  if (fd.get() < 0 || ::fstat(fd.get(), &info) != 0) return io_error("open", path);
  if (!S_ISREG(info.st_mode)) return absl::DataLossError(absl::StrFormat("%s is no regular file.", path.string()));
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size > max_bytes) {
    return absl::DataLossError(absl::StrFormat("%s has %d bytes; the limit is %d.", path.string(), size, max_bytes));
  }
  std::string bytes(size, '\0');
  std::size_t filled = 0;
  while (filled < size) {
    const ssize_t count = ::read(fd.get(), bytes.data() + filled, size - filled);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return io_error("read", path);
    if (count == 0) break;  // shrank meanwhile: the checksum will tell
    filled += static_cast<std::size_t>(count);
  }
  bytes.resize(filled);
  return bytes;
}

}  // namespace binpose::server

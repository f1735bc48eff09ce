#include "server/model_directory.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "server/durable_file.h"

namespace binpose::server {
namespace {

constexpr std::size_t kMaxIdLength = 64;
constexpr std::string_view kIdCharacters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
constexpr char kMark = '@';  ///< before the generation; no ID has it
constexpr std::string_view kDeleted = "deleted";
constexpr const char* kSign = ".binpose";

std::string file_name(std::string_view id, std::uint32_t generation) {
  if (generation == kUnnumbered) return absl::StrFormat("%s%s", id, kModelSuffix);
  return absl::StrFormat("%s%c%d%s", id, kMark, generation, kModelSuffix);
}

/// None for the name of anything else.
std::optional<std::pair<std::string, std::uint32_t>> parse_name(std::string_view name) {
  if (!name.ends_with(kModelSuffix)) return std::nullopt;
  const std::string_view stem = name.substr(0, name.size() - kModelSuffix.size());
  const std::size_t mark = stem.find(kMark);
  const std::string id(stem.substr(0, mark));
  std::uint32_t generation = kUnnumbered;
  if (mark != std::string_view::npos) {
    const std::string_view digits = stem.substr(mark + 1);
    std::from_chars(digits.data(), digits.data() + digits.size(), generation);
  }
  // One name a generation: no leading zero, nothing behind.
  if (!check_model_id("its name", id).ok() || file_name(id, generation) != name) return std::nullopt;
  return std::pair(id, generation);
}

/// None when there is no such file.
std::optional<ModelFile> look_at(const std::filesystem::path& path) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0) return std::nullopt;
  bool is_tombstone = false;
  if (S_ISLNK(info.st_mode)) {
    std::array<char, kDeleted.size() + 1> target{};
    const ssize_t length = ::readlink(path.c_str(), target.data(), target.size());
    is_tombstone = length > 0 && std::string_view(target.data(), static_cast<std::size_t>(length)) == kDeleted;
    if (!is_tombstone && ::stat(path.c_str(), &info) != 0) return std::nullopt;
  }
  return ModelFile{is_tombstone, info.st_ino, info.st_size, info.st_mtim.tv_sec * 1'000'000'000 + info.st_mtim.tv_nsec};
}

/// May miss a generation that comes and the one before, which goes, while it reads.
absl::StatusOr<DirectoryContent> read_directory(const std::filesystem::path& directory) {
  DirectoryContent content;
  bool has_sign = false;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    has_sign = has_sign || name == kSign;
    const bool is_being_written = name.starts_with('.') && !name.ends_with(kModelSuffix);
    if (is_being_written) continue;
    const std::optional<ModelFile> file = look_at(entry->path());
    if (!file) continue;
    std::error_code ignored;
    if (const auto parsed = parse_name(name)) {
      content.models[parsed->first].emplace(parsed->second, *file);
    } else if (!entry->is_directory(ignored)) {
      content.others.emplace(name, *file);
    }
  }
  if (error) {
    return absl::UnavailableError(
        absl::StrFormat("Cannot read the model directory %s: %s.", directory.string(), error.message()));
  }
  if (!has_sign) {
    return absl::UnavailableError(absl::StrFormat(
        "%s is no model directory, because it lacks the file %s; is the share mounted?", directory.string(), kSign));
  }
  return content;
}

Generations generations_of(const DirectoryContent& content, const std::string& id) {
  const auto found = content.models.find(id);
  return found == content.models.end() ? Generations() : found->second;
}

/// Whether a generation that was just published follows on those in `known`. Its name may have been free because that
/// generation was there before and is pruned already. Then newer ones are there; and since the oldest go first, what
/// was known is gone as well: another file of its name is one that another slow server has not withdrawn yet.
bool follows(const Generations& known, std::uint32_t generation, const Generations& now) {
  const bool is_newest = now.empty() || now.rbegin()->first <= generation;
  if (is_newest || known.empty()) return is_newest;
  const auto before = now.find(known.rbegin()->first);
  return before != now.end() && before->second == known.rbegin()->second && now.contains(generation + 1);
}

}  // namespace

absl::Status check_model_id(std::string_view field, std::string_view id) {
  constexpr std::string_view kRule = "it must be 1 to 64 characters of A-Z a-z 0-9 . _ - and neither '.' nor '..'";
  if (id.size() > kMaxIdLength) {
    return absl::InvalidArgumentError(absl::StrFormat("%s has %d characters; %s.", field, id.size(), kRule));
  }
  if (id.empty() || id == "." || id == ".." || id.find_first_not_of(kIdCharacters) != std::string_view::npos) {
    return absl::InvalidArgumentError(absl::StrFormat("%s is '%s'; %s.", field, id, kRule));
  }
  return absl::OkStatus();
}

std::filesystem::path model_path(const std::filesystem::path& directory, std::string_view id,
                                 std::uint32_t generation) {
  return directory / file_name(id, generation);
}

std::uint32_t generation_of(const std::filesystem::path& model_path) {
  const auto parsed = parse_name(model_path.filename().string());
  return parsed ? parsed->second : kUnnumbered;
}

absl::Status make_model_directory(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory, error)) {
    return absl::InternalError(
        absl::StrFormat("Cannot use %s as the model directory: %s.", directory.string(), error.message()));
  }
  if (has_sign(directory)) return absl::OkStatus();
  const absl::Status made = create_durably(directory, kSign, "A binpose model directory.\n");
  return absl::IsAlreadyExists(made) ? absl::OkStatus() : made;
}

bool has_sign(const std::filesystem::path& directory) {
  std::error_code ignored;
  return std::filesystem::exists(directory / kSign, ignored);
}

absl::StatusOr<DirectoryContent> list_model_directory(const std::filesystem::path& directory) {
  constexpr int kMaxTries = 10;
  absl::StatusOr<DirectoryContent> content = read_directory(directory);
  for (int i = 0; i < kMaxTries && content.ok(); ++i) {
    absl::StatusOr<DirectoryContent> again = read_directory(directory);
    const bool is_settled = again.ok() && again->models == content->models;
    content = std::move(again);
    if (is_settled) break;
  }
  return content;
}

absl::StatusOr<ModelFile> publish(const std::filesystem::path& directory, const std::string& id,
                                  std::uint32_t generation, std::string_view bytes, const Generations& known) {
  const std::string name = file_name(id, generation);
  const absl::Status created =
      bytes.empty() ? link_durably(directory, name, std::string(kDeleted)) : create_durably(directory, name, bytes);
  if (absl::IsAlreadyExists(created)) return absl::AbortedError(created.message());
  if (!created.ok()) return created;

  const absl::StatusOr<DirectoryContent> content = list_model_directory(directory);
  if (!content.ok()) return content.status();
  if (!follows(known, generation, generations_of(*content, id))) {
    ::unlink((directory / name).c_str());
    return absl::AbortedError(absl::StrFormat("Newer generations of '%s' than %d are there.", id, generation));
  }
  const std::optional<ModelFile> file = look_at(directory / name);
  return file.value_or(ModelFile());
}

void prune(const std::filesystem::path& directory, const std::string& id, std::size_t keep) {
  const absl::StatusOr<DirectoryContent> content = list_model_directory(directory);
  if (!content.ok()) return;
  const Generations all = generations_of(*content, id);
  auto first_kept = std::next(all.begin(), static_cast<std::ptrdiff_t>(all.size() - std::min(all.size(), keep)));
  for (auto it = first_kept; it != all.end(); ++it) {
    if (it->second.is_tombstone) first_kept = it;
  }
  std::vector<std::string> names;
  for (auto it = all.begin(); it != first_kept; ++it) names.push_back(file_name(id, it->first));
  if (!names.empty()) remove_durably(directory, names).IgnoreError();
}

}  // namespace binpose::server

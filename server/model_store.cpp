#include "server/model_store.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <condition_variable>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/io/model_file.h"
#include "core/parallel.h"
#include "server/durable_file.h"
#include "server/model_envelope.h"
#include "server/status.h"

namespace binpose::server {
namespace {

constexpr std::string_view kSuffix = ".model";
constexpr std::size_t kMaxIdLength = 64;
constexpr std::string_view kIdCharacters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";

std::string file_name(std::string_view id) { return std::string(id).append(kSuffix); }

absl::Status not_found(std::string_view id) {
  return absl::NotFoundError(absl::StrFormat("There is no model '%s'.", id));
}

absl::StatusOr<StoredModel> load_file(const std::filesystem::path& path, std::string_view id) {
  const absl::StatusOr<std::string> bytes = read_file(path, kMaxModelFileBytes);
  if (!bytes.ok()) return bytes.status();
  return open_envelope(id, *bytes);
}

/// None when there is no such file.
template <class Stamp>
std::optional<Stamp> stamp_of(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return std::nullopt;
  return Stamp{info.st_ino, info.st_size, info.st_mtim.tv_sec * 1'000'000'000 + info.st_mtim.tv_nsec};
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

absl::StatusOr<std::unique_ptr<ModelStore>> ModelStore::open(const std::filesystem::path& directory,
                                                             const ModelLimits& limits) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory, error)) {
    return absl::InternalError(
        absl::StrFormat("Cannot use %s as the model directory: %s.", directory.string(), error.message()));
  }
  remove_leftovers(directory, kSuffix);
  std::unique_ptr<ModelStore> store(new ModelStore(directory, limits));
  store->follow_directory(limits.load_threads);
  store->watcher_ = std::jthread([&store = *store](const std::stop_token& stop) { store.watch(stop); });
  return store;
}

/// By looking again and again: what another machine does on a shared directory raises no event here.
void ModelStore::watch(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kInterval(500);
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  while (!wake.wait_for(lock, stop, kInterval, [&stop] { return stop.stop_requested(); })) follow_directory(1);
}

void ModelStore::follow_directory(int threads) {
  const std::lock_guard disk_lock(disk_mutex_);
  absl::StatusOr<Stamps> present = list_files();
  if (!present.ok()) return;  // a share that is away for a moment takes no model with it
  std::vector<std::string> gone;
  for (const auto& [id, stamp] : stamps_) {
    if (!present->contains(id)) gone.push_back(id);
  }
  for (const std::string& id : gone) drop(id);
  std::vector<std::string> changed;
  for (const auto& [id, stamp] : *present) {
    const auto known = stamps_.find(id);
    if (known == stamps_.end() || known->second != stamp) changed.push_back(id);
  }
  stamps_ = *std::move(present);
  load_files(changed, threads);
}

/// The same for the file of one model.
void ModelStore::follow_file(const std::string& id) {
  const std::optional<FileStamp> stamp = stamp_of<FileStamp>(directory_ / file_name(id));
  std::error_code ignored;
  if (!stamp) {
    if (std::filesystem::is_directory(directory_, ignored)) drop(id);
  } else if (const auto known = stamps_.find(id); known == stamps_.end() || known->second != *stamp) {
    stamps_[id] = *stamp;
    load_files({id}, 1);
  }
}

absl::StatusOr<ModelStore::Stamps> ModelStore::list_files() {
  Stamps stamps;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(directory_, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    const std::optional<FileStamp> stamp = stamp_of<FileStamp>(entry->path());
    const bool is_being_written = name.starts_with('.') && !name.ends_with(kSuffix);
    if (!stamp || is_being_written) continue;
    const std::string id = name.substr(0, name.size() - std::min(name.size(), kSuffix.size()));
    const bool is_model = name.ends_with(kSuffix) && check_model_id("its name", id).ok();
    if (is_model) {
      stamps[id] = *stamp;
    } else if (std::error_code ignored; !entry->is_directory(ignored) && odd_files_.emplace(name, *stamp).second) {
      skip(entry->path(), "its name is not that of a model, '<id>.model'");
    }
  }
  if (error) {
    skip(directory_, error.message());
    return absl::InternalError(error.message());
  }
  return stamps;
}

void ModelStore::load_files(const std::vector<std::string>& ids, int threads) {
  std::vector<absl::StatusOr<StoredModel>> loaded(ids.size(), absl::UnknownError(""));
  parallel_for(static_cast<int>(ids.size()), threads, [&](int i) {
    const auto index = static_cast<std::size_t>(i);
    loaded[index] = contain_exceptions([&] { return load_file(directory_ / file_name(ids[index]), ids[index]); });
  });
  for (std::size_t i = 0; i < ids.size(); ++i) {
    absl::Status status = loaded[i].status();
    if (status.ok()) status = check_budget(ids[i], loaded[i]->file_bytes);
    if (status.ok()) {
      serve(std::make_shared<const StoredModel>(*std::move(loaded[i])));
    } else {
      skip(directory_ / file_name(ids[i]), std::string(status.message()));
    }
  }
}

void ModelStore::serve(std::shared_ptr<const StoredModel> stored) {
  const std::lock_guard lock(mutex_);
  models_[stored->id] = std::move(stored);
}

void ModelStore::drop(const std::string& id) {
  stamps_.erase(id);
  const std::lock_guard lock(mutex_);
  if (models_.erase(id) > 0) spdlog::info("{} is gone: its file was removed", id);
}

absl::Status ModelStore::check_budget(const std::string& id, std::size_t bytes) const {
  constexpr double kMiB = 1 << 20;
  const auto previous = find(id);
  const std::size_t others = total_bytes() - (previous.ok() ? (*previous)->file_bytes : 0);
  if (others + bytes <= limits_.total_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrFormat("Model '%s' of %.1f MiB would come to %.1f MiB of others, and --models-memory-mib is %.0f; "
                      "delete some, or raise it.",
                      id, static_cast<double>(bytes) / kMiB, static_cast<double>(others) / kMiB,
                      static_cast<double>(limits_.total_bytes) / kMiB));
}

void ModelStore::skip(const std::filesystem::path& path, std::string_view reason) {
  spdlog::warn("skipped {}: {}", path.string(), reason);
  ++skipped_files_;
}

std::size_t ModelStore::total_bytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t bytes = 0;
  for (const auto& [id, model] : models_) bytes += model->file_bytes;
  return bytes;
}

absl::StatusOr<std::shared_ptr<const StoredModel>> ModelStore::find(std::string_view id) const {
  const std::lock_guard lock(mutex_);
  const auto found = models_.find(id);
  if (found == models_.end()) return not_found(id);
  return found->second;
}

std::vector<std::shared_ptr<const StoredModel>> ModelStore::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<const StoredModel>> models;
  for (const auto& [id, model] : models_) models.push_back(model);
  return models;
}

std::size_t ModelStore::size() const {
  const std::lock_guard lock(mutex_);
  return models_.size();
}

absl::StatusOr<std::shared_ptr<const StoredModel>> ModelStore::put(const std::string& id, Model model) {
  const std::lock_guard disk_lock(disk_mutex_);
  follow_file(id);  // another server may have trained it too
  const auto previous = find(id);
  auto stored = std::make_shared<StoredModel>();
  stored->id = id;
  stored->generation = previous.ok() ? (*previous)->generation + 1 : 1;
  stored->create_time = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  stored->model = std::move(model);
  const std::string bytes = seal_envelope(*stored);
  stored->content_hash = content_hash(stored->model);
  stored->file_bytes = bytes.size();
  if (absl::Status status = check_budget(id, bytes.size()); !status.ok()) return status;
  if (absl::Status status = write_durably(directory_, file_name(id), bytes); !status.ok()) return status;
  if (const auto stamp = stamp_of<FileStamp>(directory_ / file_name(id))) stamps_[id] = *stamp;
  serve(stored);
  return stored;
}

absl::Status ModelStore::remove(const std::string& id) {
  const std::lock_guard disk_lock(disk_mutex_);
  follow_file(id);
  if (!find(id).ok()) return not_found(id);
  if (absl::Status status = remove_durably(directory_, file_name(id)); !status.ok()) return status;
  stamps_.erase(id);
  const std::lock_guard lock(mutex_);
  models_.erase(id);
  return absl::OkStatus();
}

}  // namespace binpose::server

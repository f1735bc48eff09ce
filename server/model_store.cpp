#include "server/model_store.h"

#include <spdlog/spdlog.h>

#include <system_error>
#include <utility>

#include "absl/strings/str_format.h"
#include "server/durable_file.h"
#include "server/model_envelope.h"

namespace binpose::server {
namespace {

constexpr std::string_view kSuffix = ".model";
constexpr std::size_t kMaxIdLength = 64;
constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;
constexpr std::string_view kIdCharacters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";

std::string file_name(std::string_view id) { return std::string(id).append(kSuffix); }

absl::Status not_found(std::string_view id) {
  return absl::NotFoundError(absl::StrFormat("There is no model '%s'.", id));
}

absl::StatusOr<StoredModel> load_file(const std::filesystem::path& path, std::string_view id) {
  const absl::StatusOr<std::string> bytes = read_file(path, kMaxFileBytes);
  if (!bytes.ok()) return bytes.status();
  return open_envelope(id, *bytes);
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

absl::StatusOr<std::unique_ptr<ModelStore>> ModelStore::open(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory, error)) {
    return absl::InternalError(
        absl::StrFormat("Cannot use %s as the model directory: %s.", directory.string(), error.message()));
  }
  std::unique_ptr<ModelStore> store(new ModelStore(directory));
  store->load();
  return store;
}

void ModelStore::load() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(directory_, error)) {
    const std::string name = entry.path().filename();
    std::error_code ignored;
    if (!name.ends_with(kSuffix)) {
      if (!entry.is_directory(ignored)) skip(entry.path(), "its name does not end in .model");
      continue;
    }
    const std::string id = name.substr(0, name.size() - kSuffix.size());
    const absl::Status valid_id = check_model_id("its name", id);
    absl::StatusOr<StoredModel> model = valid_id.ok() ? load_file(entry.path(), id) : valid_id;
    if (model.ok()) {
      models_[id] = std::make_shared<const StoredModel>(*std::move(model));
    } else {
      skip(entry.path(), std::string(model.status().message()));
    }
  }
  if (error) skip(directory_, error.message());
}

void ModelStore::skip(const std::filesystem::path& path, std::string_view reason) {
  spdlog::warn("skipped {}: {}", path.string(), reason);
  ++skipped_files_;
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
  const auto previous = find(id);
  auto stored = std::make_shared<StoredModel>();
  stored->id = id;
  stored->generation = previous.ok() ? (*previous)->generation + 1 : 1;
  stored->create_time = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  stored->model = std::move(model);
  const std::string bytes = seal_envelope(*stored);
  if (absl::Status status = write_durably(directory_, file_name(id), bytes); !status.ok()) return status;
  const std::lock_guard lock(mutex_);
  models_[id] = stored;
  return stored;
}

absl::Status ModelStore::remove(const std::string& id) {
  const std::lock_guard disk_lock(disk_mutex_);
  if (!find(id).ok()) return not_found(id);
  if (absl::Status status = remove_durably(directory_, file_name(id)); !status.ok()) return status;
  const std::lock_guard lock(mutex_);
  models_.erase(id);
  return absl::OkStatus();
}

}  // namespace binpose::server

#include "server/model_cache.h"

#include <algorithm>
#include <future>
#include <utility>

#include "absl/strings/str_format.h"
#include "server/convert_training.h"
#include "server/status.h"

namespace binpose::server {
namespace {

absl::Status not_found(std::string_view id) {
  return absl::NotFoundError(absl::StrFormat("There is no model '%s'.", id));
}

}  // namespace

/// A file that is being read, for all who wait for it.
struct ModelCache::Flight {
  std::promise<absl::StatusOr<ModelPointer>> promise;
  std::shared_future<absl::StatusOr<ModelPointer>> result = promise.get_future().share();
};

absl::Status ModelCache::check_size(std::string_view id, const Model& model) const {
  constexpr double kMiB = 1 << 20;
  const std::size_t bytes = memory_bytes(model);
  if (bytes <= budget_) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrFormat("Model '%s' takes %.1f MiB of memory, and --models-memory-mib is %.0f; raise it.", id,
                      static_cast<double>(bytes) / kMiB, static_cast<double>(budget_) / kMiB));
}

void ModelCache::put(ModelPointer model, const std::filesystem::path& file) {
  v1::Model description = to_proto(*model);
  const std::size_t bytes = memory_bytes(model->model);
  const std::lock_guard lock(mutex_);
  const auto [found, is_new] = entries_.try_emplace(model->id);
  Entry& entry = found->second;
  if (is_new) ++usage_.models;
  drop(entry);
  entry.description = std::move(description);
  entry.file = file;
  entry.bytes = bytes;
  entry.flight.reset();  // what is being read is the one before
  keep(entry, std::move(model));
}

bool ModelCache::erase(std::string_view id) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(id);
  if (found == entries_.end()) return false;
  drop(found->second);
  entries_.erase(found);
  --usage_.models;
  return true;
}

/// Takes a model into memory, for which others may leave. Under the lock.
void ModelCache::keep(Entry& entry, ModelPointer model) {
  while (usage_.in_memory > 0 && usage_.bytes + entry.bytes > budget_) {
    Entry* idlest = nullptr;
    for (auto& [id, other] : entries_) {
      if (other.model != nullptr && (idlest == nullptr || other.last_use < idlest->last_use)) idlest = &other;
    }
    drop(*idlest);
  }
  usage_.bytes += entry.bytes;
  ++usage_.in_memory;
  entry.model = std::move(model);
  entry.last_use = ++uses_;
}

/// Lets a model leave memory, if it is there. Under the lock.
void ModelCache::drop(Entry& entry) {
  if (entry.model == nullptr) return;
  usage_.bytes -= entry.bytes;
  --usage_.in_memory;
  entry.model.reset();
}

absl::StatusOr<ModelCache::ModelPointer> ModelCache::find(std::string_view id) {
  std::unique_lock lock(mutex_);
  auto found = entries_.find(id);
  if (found == entries_.end()) return not_found(id);
  Entry& entry = found->second;
  entry.last_use = ++uses_;
  if (entry.model != nullptr) return entry.model;
  if (entry.flight != nullptr) {
    const auto result = entry.flight->result;
    lock.unlock();
    return result.get();
  }
  const auto flight = entry.flight = std::make_shared<Flight>();
  const std::filesystem::path file = entry.file;
  lock.unlock();

  absl::StatusOr<ModelPointer> result = contain_exceptions([&]() -> absl::StatusOr<ModelPointer> {
    absl::StatusOr<StoredModel> loaded = load_(file, std::string(id));
    if (loaded.ok()) return std::make_shared<const StoredModel>(*std::move(loaded));
    return absl::UnavailableError(absl::StrFormat("Model '%s' is not in memory, and its file %s cannot be read: %s", id,
                                                  file.string(), loaded.status().message()));
  });
  lock.lock();
  found = entries_.find(id);
  const bool is_current = found != entries_.end() && found->second.flight == flight;  // or it was replaced meanwhile
  if (is_current) {
    found->second.flight.reset();
    if (result.ok()) keep(found->second, *result);
  }
  if (result.ok()) ++usage_.loads;
  lock.unlock();
  flight->promise.set_value(result);
  return result;
}

absl::StatusOr<v1::Model> ModelCache::describe(std::string_view id) const {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(id);
  if (found == entries_.end()) return not_found(id);
  return found->second.description;
}

std::vector<v1::Model> ModelCache::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<v1::Model> models;
  models.reserve(entries_.size());
  for (const auto& [id, entry] : entries_) models.push_back(entry.description);
  return models;
}

std::set<std::string> ModelCache::ids() const {
  const std::lock_guard lock(mutex_);
  std::set<std::string> ids;
  for (const auto& [id, entry] : entries_) ids.insert(ids.end(), id);
  return ids;
}

ModelCache::Usage ModelCache::usage() const {
  const std::lock_guard lock(mutex_);
  return usage_;
}

}  // namespace binpose::server

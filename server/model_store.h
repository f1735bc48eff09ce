#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/model.h"

namespace binpose::server {

/// A model as it is kept and served; immutable.
struct StoredModel {
  std::string id;
  std::uint32_t generation = 0;  ///< counts up from 1 with every training of the ID
  std::chrono::sys_seconds create_time;
  std::string content_hash;  ///< binpose::content_hash(model)
  std::size_t file_bytes = 0;
  Model model;
};

/// OK, or INVALID_ARGUMENT unless `id` is 1 to 64 characters of [A-Za-z0-9._-] and neither "." nor "..".
///
/// @param field  what to call it in the message.
absl::Status check_model_id(std::string_view field, std::string_view id);

/// The models by ID, in memory and, as `<id>.model`, in a directory. What put() and remove() acknowledge survives a
/// power cut. Thread-safe; readers never wait for the disk.
class ModelStore {
 public:
  /// Loads the models of `directory`, which is made if it is missing. A file that is torn, foreign or unreadable is
  /// logged, counted and left alone. Errors: INTERNAL (no such directory can be had).
  static absl::StatusOr<std::unique_ptr<ModelStore>> open(const std::filesystem::path& directory);

  /// NOT_FOUND, naming the ID.
  absl::StatusOr<std::shared_ptr<const StoredModel>> find(std::string_view id) const;
  /// Ordered by ID.
  std::vector<std::shared_ptr<const StoredModel>> list() const;
  std::size_t size() const;

  /// Saves a model and then, only then, serves it in place of the one before. Errors: INTERNAL (not saved).
  absl::StatusOr<std::shared_ptr<const StoredModel>> put(const std::string& id, Model model);
  /// Removes a model from the directory, then from memory; who holds it keeps it. Errors: NOT_FOUND, INTERNAL.
  absl::Status remove(const std::string& id);

  /// Files that open() could not use.
  std::size_t skipped_files() const { return skipped_files_; }

 private:
  explicit ModelStore(std::filesystem::path directory) : directory_(std::move(directory)) {}
  void load();
  void skip(const std::filesystem::path& path, std::string_view reason);

  const std::filesystem::path directory_;
  std::size_t skipped_files_ = 0;
  std::mutex disk_mutex_;     ///< held while a file and its entry change; taken before mutex_
  mutable std::mutex mutex_;  ///< guards models_
  std::map<std::string, std::shared_ptr<const StoredModel>, std::less<>> models_;
};

}  // namespace binpose::server

#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
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

/// Largest model file that is read.
inline constexpr std::size_t kMaxModelFileBytes = std::size_t{256} << 20;

/// What may be held of models.
struct ModelLimits {
  std::size_t total_bytes = std::size_t{1} << 30;  ///< sum of the sizes of the files
  int load_threads = 1;                            ///< how many files are read at once by open()
};

/// The models by ID, in memory and, as `<id>.model`, in a directory. What put() and remove() acknowledge survives a
/// power cut. What another process puts into the directory or removes is followed within 2 seconds; a file that cannot
/// be used never takes the place of a model that is served. Thread-safe; readers never wait for the disk.
class ModelStore {
 public:
  /// Loads the models of `directory`, which is made if it is missing. A file that is torn, foreign or unreadable is
  /// logged, counted and left alone. Errors: INTERNAL (no such directory can be had).
  static absl::StatusOr<std::unique_ptr<ModelStore>> open(const std::filesystem::path& directory,
                                                          const ModelLimits& limits = {});

  /// NOT_FOUND, naming the ID.
  absl::StatusOr<std::shared_ptr<const StoredModel>> find(std::string_view id) const;
  /// Ordered by ID.
  std::vector<std::shared_ptr<const StoredModel>> list() const;
  std::size_t size() const;

  /// Saves a model and then, only then, serves it in place of the one before. Errors: INTERNAL (not saved),
  /// RESOURCE_EXHAUSTED (over ModelLimits); either way the one before stays.
  absl::StatusOr<std::shared_ptr<const StoredModel>> put(const std::string& id, Model model);
  /// Removes a model from the directory, then from memory; who holds it keeps it. Errors: NOT_FOUND, INTERNAL.
  absl::Status remove(const std::string& id);

  /// Times that a file could not be used.
  std::size_t skipped_files() const { return skipped_files_; }
  /// Sum of the sizes of the files that are served.
  std::size_t total_bytes() const;

 private:
  /// Tells whether a file is still the one that was read.
  struct FileStamp {
    std::uint64_t inode = 0;
    std::int64_t size = 0;
    std::int64_t change_time = 0;  // nanoseconds
    bool operator==(const FileStamp&) const = default;
  };
  using Stamps = std::map<std::string, FileStamp, std::less<>>;

  ModelStore(std::filesystem::path directory, const ModelLimits& limits)
      : directory_(std::move(directory)), limits_(limits) {}
  void follow_directory(int threads);
  void follow_file(const std::string& id);
  absl::StatusOr<Stamps> list_files();
  void load_files(const std::vector<std::string>& ids, int threads);
  void drop(const std::string& id);
  absl::Status check_budget(const std::string& id, std::size_t bytes) const;
  void serve(std::shared_ptr<const StoredModel> stored);
  void skip(const std::filesystem::path& path, std::string_view reason);
  void watch(const std::stop_token& stop);

  const std::filesystem::path directory_;
  const ModelLimits limits_;
  std::atomic<std::size_t> skipped_files_ = 0;
  std::mutex disk_mutex_;     ///< held while a file and its entry change; taken before mutex_
  Stamps stamps_;             ///< of the files that were looked at, good or not; guarded by disk_mutex_
  Stamps odd_files_;          ///< others that were logged already; guarded by disk_mutex_
  mutable std::mutex mutex_;  ///< guards models_
  std::map<std::string, std::shared_ptr<const StoredModel>, std::less<>> models_;
  std::jthread watcher_;  ///< last, so that it ends before the rest goes
};

}  // namespace binpose::server

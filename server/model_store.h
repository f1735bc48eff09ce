#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/hang_guard.h"
#include "server/model_cache.h"
#include "server/model_directory.h"

namespace binpose::server {

/// Largest model file that is read.
inline constexpr std::size_t kMaxModelFileBytes = std::size_t{256} << 20;

/// What may be held of models.
struct ModelLimits {
  std::size_t memory_bytes = std::size_t{1} << 30;  ///< of those in memory
  std::size_t keep_generations = 2;                 ///< of a model in the directory, the one that is served included
  int load_threads = 1;                             ///< how many files are read at once by open()
};

/// The models by ID, in memory and in a directory that other servers may share. What put() and remove() acknowledge
/// survives a power cut. What another server puts or removes is followed within 2 seconds; a file that cannot be used
/// never takes the place of a model that is served. All are in memory as long as they fit there, and served while the
/// directory is away. Thread-safe; reading waits for the disk only for a model that did not fit (see ModelCache).
class ModelStore {
 public:
  /// Loads the models of `directory`, which is made if it is missing. A file that is torn, foreign or unreadable is
  /// logged, counted and left alone. Errors: INTERNAL (no such directory can be had).
  static absl::StatusOr<std::unique_ptr<ModelStore>> open(const std::filesystem::path& directory,
                                                          const ModelLimits& limits = {});

  /// Errors: NOT_FOUND, naming the ID; UNAVAILABLE (it had left memory, and cannot be read).
  absl::StatusOr<std::shared_ptr<const StoredModel>> find(const std::string& id);
  /// Errors: NOT_FOUND, naming the ID.
  absl::StatusOr<v1::Model> describe(std::string_view id) const { return cache_.describe(id); }
  /// Ordered by ID.
  std::vector<v1::Model> list() const { return cache_.list(); }
  std::set<std::string> ids() const { return cache_.ids(); }
  ModelCache::Usage usage() const { return cache_.usage(); }

  /// Saves a model as the next generation and then, only then, serves it in place of the one before. Errors: INTERNAL
  /// (not saved), UNAVAILABLE (the directory is away), RESOURCE_EXHAUSTED (over ModelLimits); the one before stays.
  absl::StatusOr<std::shared_ptr<const StoredModel>> put(const std::string& id, Model model);
  /// Removes a model from the directory, then from memory; who holds it keeps it. Errors: NOT_FOUND, INTERNAL,
  /// UNAVAILABLE (the directory is away).
  absl::Status remove(const std::string& id);

  /// Times that a file could not be used.
  std::size_t skipped_files() const { return skipped_files_; }
  /// Seconds since the directory last answered; large while it is away.
  double directory_age() const { return guard_.age(); }

 private:
  /// The file that a served model was read from.
  struct Place {
    std::uint32_t generation = 0;
    ModelFile file;
  };
  struct Look;

  ModelStore(std::filesystem::path directory, const ModelLimits& limits);
  bool follow_directory(int threads);
  absl::StatusOr<Generations> follow_model(const std::string& id);
  absl::StatusOr<DirectoryContent> list_directory();
  Look look_for(const std::string& id, const Generations& generations) const;
  bool apply(const std::string& id, Look look);
  absl::StatusOr<Place> publish_next(
      const std::string& id, const std::function<absl::StatusOr<std::string>(std::uint32_t generation)>& content);
  absl::StatusOr<std::shared_ptr<const StoredModel>> save(std::shared_ptr<StoredModel> stored);
  absl::Status erase(const std::string& id);
  std::uint32_t next_generation(const std::string& id, const Generations& known) const;
  void drop(const std::string& id);
  void serve(std::shared_ptr<const StoredModel> stored, const Place& place);
  void skip(const std::filesystem::path& path, const ModelFile& file, std::string_view reason);
  void watch(const std::stop_token& stop);

  const std::filesystem::path directory_;
  const ModelLimits limits_;
  ModelCache cache_;  ///< what is served
  std::atomic<std::size_t> skipped_files_ = 0;
  std::mutex disk_mutex_;  ///< guards what follows, and is held while a file and its entry change
  std::map<std::string, Generations, std::less<>> seen_;   ///< that were dealt with
  std::map<std::string, std::uint32_t, std::less<>> put_;  ///< generations that this server put last
  std::map<std::string, Place, std::less<>> places_;       ///< of the models that are served
  std::map<std::string, ModelFile> skipped_;               ///< files that were logged already, by path
  HangGuard guard_;       ///< after all that its calls use, so that they end before that goes
  std::jthread watcher_;  ///< last, for the same reason
};

}  // namespace binpose::server

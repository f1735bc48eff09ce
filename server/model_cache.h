#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "binpose/v1/model_service.pb.h"
#include "server/model_envelope.h"

namespace binpose::server {

/// The models by ID as they are served: all are described, and as many as the budget allows are in memory. One that is
/// not is loaded when it is asked for, once for all who ask at that moment; those that were not asked for longest leave
/// for it. Who holds a model keeps it. Thread-safe; only find() of a model that is not in memory waits for the disk.
class ModelCache {
 public:
  using ModelPointer = std::shared_ptr<const StoredModel>;
  /// Reads a model again; errors say what is wrong with the file.
  using Load = std::function<absl::StatusOr<StoredModel>(const std::filesystem::path& file, const std::string& id)>;

  /// @param budget  bytes of memory for models; those that are held beyond their time here come on top.
  ModelCache(std::size_t budget, Load load) : budget_(budget), load_(std::move(load)) {}

  /// RESOURCE_EXHAUSTED when a model alone is more than the budget.
  absl::Status check_size(std::string_view id, const Model& model) const;
  /// Serves a model, which check_size() accepts, in place of the one of the same ID.
  void put(ModelPointer model, const std::filesystem::path& file);
  /// False when there was none.
  bool erase(std::string_view id);

  /// Errors: NOT_FOUND, naming the ID; UNAVAILABLE (its file cannot be read again).
  absl::StatusOr<ModelPointer> find(std::string_view id);
  /// Errors: NOT_FOUND, naming the ID.
  absl::StatusOr<v1::Model> describe(std::string_view id) const;
  /// Ordered by ID.
  std::vector<v1::Model> list() const;
  std::set<std::string> ids() const;

  struct Usage {
    std::size_t models = 0;     ///< that are served
    std::size_t in_memory = 0;  ///< of them
    std::size_t bytes = 0;      ///< that those take
    std::size_t loads = 0;      ///< of models that had left, since the start
  };
  Usage usage() const;

 private:
  struct Flight;
  struct Entry {
    v1::Model description;
    std::filesystem::path file;
    std::size_t bytes = 0;           ///< memory_bytes()
    ModelPointer model;              ///< null while it is not in memory
    std::shared_ptr<Flight> flight;  ///< while it is being loaded
    std::uint64_t last_use = 0;
  };

  void keep(Entry& entry, ModelPointer model);
  void drop(Entry& entry);

  const std::size_t budget_;
  const Load load_;
  mutable std::mutex mutex_;  ///< guards what follows
  std::map<std::string, Entry, std::less<>> entries_;
  Usage usage_;
  std::uint64_t uses_ = 0;
};

}  // namespace binpose::server

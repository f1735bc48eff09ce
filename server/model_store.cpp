#include "server/model_store.h"

#include <spdlog/spdlog.h>

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

/// Tries to put a generation before giving up: as many as others may put meanwhile.
constexpr int kMaxTries = 100;

/// The generation is the one in the file's name, if it has one.
absl::StatusOr<StoredModel> load_file(const std::filesystem::path& path, const std::string& id) {
  const absl::StatusOr<std::string> bytes = read_file(path, kMaxModelFileBytes);
  if (!bytes.ok()) return bytes.status();
  absl::StatusOr<StoredModel> stored = open_envelope(id, *bytes);
  const std::uint32_t generation = generation_of(path);
  if (stored.ok() && generation != kUnnumbered) stored->generation = generation;
  return stored;
}

}  // namespace

ModelStore::ModelStore(std::filesystem::path directory, const ModelLimits& limits)
    : directory_(std::move(directory)),
      limits_(limits),
      cache_(limits.memory_bytes,
             [this](const std::filesystem::path& path, const std::string& id) {
               return guard_.run([path, id] { return load_file(path, id); });
             }),
      guard_(directory_, [this] { return has_sign(directory_); }) {}

/// What came of looking for the newest generation of a model that can be used.
struct ModelStore::Look {
  struct Fault {
    std::filesystem::path path;
    ModelFile file;
    std::string reason;
  };
  std::optional<StoredModel> model;  ///< to serve instead of what is served
  Place place;                       ///< of `model`
  bool is_gone = false;              ///< the model was deleted
  bool is_settled = true;            ///< false: a file could not be read just now, or was pruned meanwhile
  std::vector<Fault> faults;
};

absl::StatusOr<std::unique_ptr<ModelStore>> ModelStore::open(const std::filesystem::path& directory,
                                                             const ModelLimits& limits) {
  // First, since its guard tells if one of the next steps hangs.
  std::unique_ptr<ModelStore> store(new ModelStore(directory, limits));
  if (absl::Status status = make_model_directory(directory); !status.ok()) return status;
  // To serve nothing because nothing can be read would be worse than not to start.
  if (absl::Status status = list_model_directory(directory).status(); !status.ok()) {
    return absl::InternalError(status.message());
  }
  remove_leftovers(directory, kModelSuffix);
  constexpr int kLooks = 3;  // at a directory where others prune
  for (int i = 0; i < kLooks && !store->follow_directory(limits.load_threads); ++i) {
  }
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

/// False when it is worth looking again at once.
bool ModelStore::follow_directory(int threads) {
  const std::lock_guard disk_lock(disk_mutex_);
  const absl::StatusOr<DirectoryContent> content = list_directory();
  if (!content.ok()) return false;
  std::erase_if(skipped_, [](const auto& skipped) {
    std::error_code ignored;
    return !std::filesystem::exists(skipped.first, ignored);
  });
  for (const auto& [name, file] : content->others) {
    skip(directory_ / name, file, "its name is not that of a model, '<id>@<generation>.model' or '<id>.model'");
  }
  std::vector<std::string> gone;
  for (const auto& [id, generations] : seen_) {
    if (!content->models.contains(id)) gone.push_back(id);
  }
  for (const std::string& id : gone) drop(id);
  std::vector<std::string> changed;
  for (const auto& [id, generations] : content->models) {
    const auto known = seen_.find(id);
    if (known == seen_.end() || known->second != generations) changed.push_back(id);
  }
  // Some at a time: all at once may be more than memory holds.
  const std::size_t batch = static_cast<std::size_t>(threads) * 4;
  std::vector<Look> looks(batch);
  bool is_settled = true;
  for (std::size_t begin = 0; begin < changed.size(); begin += batch) {
    const std::size_t count = std::min(batch, changed.size() - begin);
    parallel_for(static_cast<int>(count), threads, [&](int i) {
      const std::string& id = changed[begin + static_cast<std::size_t>(i)];
      looks[static_cast<std::size_t>(i)] = look_for(id, content->models.at(id));
    });
    for (std::size_t i = 0; i < count; ++i) {
      const std::string& id = changed[begin + i];
      const bool is_done = apply(id, std::move(looks[i]));
      if (is_done) seen_[id] = content->models.at(id);
      is_settled = is_settled && is_done;
    }
  }
  return is_settled;
}

/// The same for one model; its generations. Under the lock.
absl::StatusOr<Generations> ModelStore::follow_model(const std::string& id) {
  const absl::StatusOr<DirectoryContent> content = list_directory();
  if (!content.ok()) return content.status();
  const auto found = content->models.find(id);
  if (found == content->models.end()) {
    drop(id);
    return Generations();
  }
  if (apply(id, look_for(id, found->second))) seen_[id] = found->second;
  return found->second;
}

/// Notes whether the directory is there: a share that is away for a moment takes no model with it.
absl::StatusOr<DirectoryContent> ModelStore::list_directory() {
  absl::StatusOr<DirectoryContent> content = list_model_directory(directory_);
  content.ok() ? guard_.note_answer() : guard_.note_fault(content.status());
  return content;
}

ModelStore::Look ModelStore::look_for(const std::string& id, const Generations& generations) const {
  Look look;
  const auto current = places_.find(id);
  // NOLINTNEXTLINE(modernize-loop-convert): clang 14 can't compile libstdc++'s reversed view
  for (auto entry = generations.rbegin(); entry != generations.rend(); ++entry) {
    const std::uint32_t generation = entry->first;
    const ModelFile& file = entry->second;
    if (file.is_tombstone) {
      look.is_gone = true;
      return look;
    }
    const bool is_served = current != places_.end() && current->second.generation == generation;
    if (is_served && current->second.file == file) return look;
    const std::filesystem::path path = model_path(directory_, id, generation);
    absl::StatusOr<StoredModel> loaded = contain_exceptions([&] { return load_file(path, id); });
    if (loaded.ok()) {
      look.model = *std::move(loaded);
      look.place = {generation, file};
      return look;
    }
    std::error_code ignored;
    look.is_settled = !absl::IsInternal(loaded.status());
    if (!look.is_settled && !std::filesystem::exists(path, ignored)) return look;  // pruned: there are newer ones
    look.faults.push_back({path, file, std::string(loaded.status().message())});
    if (!look.is_settled || is_served) return look;  // what is in memory is newer than what else is there
  }
  return look;
}

/// False when the look has to be repeated.
bool ModelStore::apply(const std::string& id, Look look) {
  for (const Look::Fault& fault : look.faults) skip(fault.path, fault.file, fault.reason);
  if (look.is_gone) drop(id);
  if (!look.model) return look.is_settled;
  if (absl::Status status = cache_.check_size(id, look.model->model); !status.ok()) {
    skip(model_path(directory_, id, look.place.generation), look.place.file, std::string(status.message()));
  } else {
    serve(std::make_shared<const StoredModel>(*std::move(look.model)), look.place);
  }
  return look.is_settled;
}

void ModelStore::serve(std::shared_ptr<const StoredModel> stored, const Place& place) {
  places_[stored->id] = place;
  const std::filesystem::path file = model_path(directory_, stored->id, place.generation);
  cache_.put(std::move(stored), file);
}

void ModelStore::drop(const std::string& id) {
  seen_.erase(id);
  places_.erase(id);
  if (cache_.erase(id)) spdlog::info("{} is gone: its files were removed", id);
}

/// Logs and counts a file once, until it changes.
void ModelStore::skip(const std::filesystem::path& path, const ModelFile& file, std::string_view reason) {
  const auto [entry, is_new] = skipped_.emplace(path, file);
  if (!is_new && std::exchange(entry->second, file) == file) return;
  spdlog::warn("skipped {}: {}", path.string(), reason);
  ++skipped_files_;
}

absl::StatusOr<std::shared_ptr<const StoredModel>> ModelStore::find(const std::string& id) {
  auto found = cache_.find(id);
  if (!absl::IsUnavailable(found.status())) return found;
  // Its file may have been replaced and pruned since the last look.
  const absl::Status followed = guard_.run([this, id]() -> absl::Status {
    const std::lock_guard disk_lock(disk_mutex_);
    return follow_model(id).status();
  });
  return followed.ok() ? cache_.find(id) : followed;
}

std::uint32_t ModelStore::next_generation(const std::string& id, const Generations& known) const {
  const std::uint32_t newest = known.empty() ? 0 : known.rbegin()->first;
  const auto served = describe(id);  // of an unnumbered file, only its content tells the generation
  const auto put = put_.find(id);
  return 1 + std::max({newest, served.ok() ? served->generation() : 0, put != put_.end() ? put->second : 0});
}

/// Puts the next generation of a model into the directory, again while other servers are faster.
///
/// @param content  what to write as a generation, empty for a tombstone; an error ends it.
absl::StatusOr<ModelStore::Place> ModelStore::publish_next(
    const std::string& id, const std::function<absl::StatusOr<std::string>(std::uint32_t generation)>& content) {
  absl::Status failure;
  for (int i = 0; i < kMaxTries; ++i) {
    const absl::StatusOr<Generations> known = follow_model(id);
    if (!known.ok()) return known.status();
    const std::uint32_t generation = next_generation(id, *known);
    const absl::StatusOr<std::string> bytes = content(generation);
    if (!bytes.ok()) return bytes.status();
    const absl::StatusOr<ModelFile> file = publish(directory_, id, generation, *bytes, *known);
    if (file.ok()) return Place{generation, *file};
    failure = file.status();
    if (!absl::IsAborted(failure)) break;
  }
  return failure;
}

absl::StatusOr<std::shared_ptr<const StoredModel>> ModelStore::put(const std::string& id, Model model) {
  auto stored = std::make_shared<StoredModel>();
  stored->id = id;
  stored->create_time = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  stored->model = std::move(model);
  stored->content_hash = content_hash(stored->model);
  if (absl::Status status = cache_.check_size(id, stored->model); !status.ok()) return status;
  return guard_.run([this, stored] { return save(stored); });
}

absl::StatusOr<std::shared_ptr<const StoredModel>> ModelStore::save(std::shared_ptr<StoredModel> stored) {
  const std::string& id = stored->id;
  const std::lock_guard disk_lock(disk_mutex_);
  const auto place = publish_next(id, [&](std::uint32_t generation) -> absl::StatusOr<std::string> {
    stored->generation = generation;
    std::string bytes = seal_envelope(*stored);
    stored->file_bytes = bytes.size();
    return bytes;
  });
  if (!place.ok()) return place.status();
  put_[id] = place->generation;
  serve(stored, *place);
  prune(directory_, id, limits_.keep_generations);
  return stored;
}

absl::Status ModelStore::remove(const std::string& id) {
  return guard_.run([this, id] { return erase(id); });
}

absl::Status ModelStore::erase(const std::string& id) {
  const std::lock_guard disk_lock(disk_mutex_);
  int tries = 0;
  const auto place = publish_next(id, [&](std::uint32_t) -> absl::StatusOr<std::string> {
    ++tries;
    if (absl::Status status = describe(id).status(); !status.ok()) return status;
    return std::string();
  });
  if (absl::IsNotFound(place.status()) && tries > 1) return absl::OkStatus();  // another server was faster
  if (!place.ok()) return place.status();
  prune(directory_, id, limits_.keep_generations);
  drop(id);
  return absl::OkStatus();
}

}  // namespace binpose::server

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

/// The files of the model directory, which several servers may share; its rules are in server/README.md.
namespace binpose::server {

/// OK, or INVALID_ARGUMENT unless `id` is 1 to 64 characters of [A-Za-z0-9._-] and neither "." nor "..".
///
/// @param field  what to call it in the message.
absl::Status check_model_id(std::string_view field, std::string_view id);

/// The ending of the names of model files.
inline constexpr std::string_view kModelSuffix = ".model";
/// The generation, by its name, of `<id>.model`, which earlier releases wrote: older than every other.
inline constexpr std::uint32_t kUnnumbered = 0;

/// One generation of a model as it lies in the directory.
struct ModelFile {
  bool is_tombstone = false;  ///< says that the model was deleted
  // Whether it is still the file that was read:
  std::uint64_t inode = 0;
  std::int64_t size = 0;
  std::int64_t change_time = 0;  ///< nanoseconds
  bool operator==(const ModelFile&) const = default;
};

/// The generations of one ID that are there; the highest counts.
using Generations = std::map<std::uint32_t, ModelFile>;

struct DirectoryContent {
  std::map<std::string, Generations, std::less<>> models;  ///< by ID
  std::map<std::string, ModelFile> others;                 ///< by name; neither models nor files of ours
};

std::filesystem::path model_path(const std::filesystem::path& directory, std::string_view id, std::uint32_t generation);
/// The generation that the name of such a path says.
std::uint32_t generation_of(const std::filesystem::path& model_path);

/// Makes a model directory, or takes the one that is there. Errors: INTERNAL.
absl::Status make_model_directory(const std::filesystem::path& directory);

/// Whether it is there and answers.
bool has_sign(const std::filesystem::path& directory);

/// What two readings in a row agree on, since one that others write to meanwhile may see neither of two generations.
/// Errors: UNAVAILABLE, when it cannot be read or is not the model directory, but for example the empty folder that a
/// share was mounted on.
absl::StatusOr<DirectoryContent> list_model_directory(const std::filesystem::path& directory);

/// Puts a file into the directory as a generation that follows on those in `known`; or nothing, when another server was
/// faster. What is acknowledged survives a power cut.
///
/// @param bytes  of the model; empty: a tombstone.
/// @param known  what was listed just before.
/// @return the file. Errors: ABORTED (another server was faster: list and try again), UNAVAILABLE, INTERNAL.
absl::StatusOr<ModelFile> publish(const std::filesystem::path& directory, const std::string& id,
                                  std::uint32_t generation, std::string_view bytes, const Generations& known);

/// Removes all but the newest `keep` generations, and all below a tombstone, the oldest first. Faults are left to the
/// next time.
void prune(const std::filesystem::path& directory, const std::string& id, std::size_t keep);

}  // namespace binpose::server

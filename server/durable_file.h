#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

/// Files that are there whole or not at all, whenever the power goes.
namespace binpose::server {

/// Makes the file `directory`/`name` of `bytes`, unless it is there: temporary file, fsync, link, fsync of the
/// directory. One alone of several that try at the same time succeeds, on NFS too. On OK the file survives a power cut.
/// A temporary file that a crash leaves behind is named ".<name>.XXXXXX". Errors: ALREADY_EXISTS, INTERNAL (naming file
/// and reason, for example a full disk).
absl::Status create_durably(const std::filesystem::path& directory, const std::string& name, std::string_view bytes);

/// The same of a symbolic link to `target`, which takes no room on a full disk.
absl::Status link_durably(const std::filesystem::path& directory, const std::string& name, const std::string& target);

/// Removes the temporary files of names with this ending that a crash left behind: nobody has written to them for ten
/// minutes, so that those of another server on the same directory stay.
void remove_leftovers(const std::filesystem::path& directory, std::string_view ending);

/// Removes files, one after the other, so that they stay away after a power cut; a missing one is no error. Errors:
/// INTERNAL.
absl::Status remove_durably(const std::filesystem::path& directory, const std::vector<std::string>& names);

/// The bytes of a regular file. Errors: INTERNAL (naming file and reason), DATA_LOSS (no regular file, or longer than
/// `max_bytes`).
absl::StatusOr<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace binpose::server

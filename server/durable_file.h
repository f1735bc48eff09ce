#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

/// Files that are there whole or not at all, whenever the power goes.
namespace binpose::server {

/// Replaces `directory`/`name` by `bytes`: temporary file, fsync, rename, fsync of the directory. On OK the file
/// survives a power cut; otherwise the old one is as it was. A temporary file that a crash leaves behind is named
/// ".<name>.XXXXXX". Errors: INTERNAL (naming file and reason, for example a full disk).
absl::Status write_durably(const std::filesystem::path& directory, const std::string& name, std::string_view bytes);

/// Removes the temporary files of names with this ending that a crash left behind: nobody has written to them for ten
/// minutes, so that those of another server on the same directory stay.
void remove_leftovers(const std::filesystem::path& directory, std::string_view ending);

/// Removes `directory`/`name` so that it stays away after a power cut; a missing file is no error. Errors: INTERNAL.
absl::Status remove_durably(const std::filesystem::path& directory, const std::string& name);

/// The bytes of a regular file. Errors: INTERNAL (naming file and reason), DATA_LOSS (no regular file, or longer than
/// `max_bytes`).
absl::StatusOr<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace binpose::server

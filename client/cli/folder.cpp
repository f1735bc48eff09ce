#include "client/cli/folder.h"

#include <algorithm>
#include <system_error>
#include <utility>

namespace binpose::client::cli {

Folder::Folder(std::filesystem::path path, std::set<std::string> endings)
    : path_(std::move(path)), endings_(std::move(endings)) {}

std::map<std::filesystem::path, Folder::State> Folder::list() const {
  std::map<std::filesystem::path, State> files;
  std::error_code error;
  // Files may vanish while they are looked at; such are left out.
  for (std::filesystem::directory_iterator entry(path_, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code gone;
    State state;
    if (!entry->is_regular_file(gone) || !endings_.contains(entry->path().extension().string())) continue;
    state.size = entry->file_size(gone);
    if (gone || state.size == 0) continue;
    state.time = entry->last_write_time(gone);
    if (!gone) files.emplace(entry->path(), state);
  }
  return files;
}

std::vector<std::filesystem::path> Folder::look() {
  std::map<std::filesystem::path, State> now = list();
  std::vector<std::filesystem::path> complete;
  for (auto& [file, state] : now) {
    const auto before = known_.find(file);
    if (before == known_.end() || before->second.size != state.size || before->second.time != state.time) continue;
    if (!before->second.is_returned) complete.push_back(file);
    state.is_returned = true;
  }
  std::stable_sort(complete.begin(), complete.end(),
                   [&](const auto& a, const auto& b) { return now.at(a).time < now.at(b).time; });
  known_ = std::move(now);
  return complete;
}

void Folder::skip() {
  known_ = list();
  for (auto& [file, state] : known_) state.is_returned = true;
}

void Folder::put_back(const std::filesystem::path& file) {
  if (const auto state = known_.find(file); state != known_.end()) state->second.is_returned = false;
}

}  // namespace binpose::client::cli

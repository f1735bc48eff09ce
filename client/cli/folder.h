#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace binpose::client::cli {

/// The files that someone else puts into a folder. A file counts as complete when two looks in a row find it unchanged
/// in size and time. Looking works on network shares too, where the kernel tells of no changes.
class Folder {
 public:
  /// `endings`: of the names that count, like ".ply".
  Folder(std::filesystem::path path, std::set<std::string> endings);

  /// Files that are complete and were not returned before, or have changed since; in the order of their times.
  std::vector<std::filesystem::path> look();

  /// Counts all that is there now as returned before.
  void skip();

  /// Has `file` returned again by the next look.
  void put_back(const std::filesystem::path& file);

 private:
  struct State {
    std::uintmax_t size = 0;
    std::filesystem::file_time_type time;
    bool is_returned = false;
  };
  std::map<std::filesystem::path, State> list() const;

  const std::filesystem::path path_;
  const std::set<std::string> endings_;
  std::map<std::filesystem::path, State> known_;  ///< by the last look
};

}  // namespace binpose::client::cli

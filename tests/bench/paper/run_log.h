#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace binpose::paper {

using Json = nlohmann::ordered_json;

/// What has been measured, one line of JSON each: a run that was stopped goes on behind the last whole line.
class RunLog {
 public:
  explicit RunLog(const std::filesystem::path& path);

  bool has(const std::string& key) const { return keys_.contains(key); }
  void add(const std::string& key, Json entry);

 private:
  std::set<std::string> keys_;
  std::ofstream file_;
};

/// Tells on the terminal how far a run has come: "table 12/32 spindle_003".
void show_progress(const std::string& run, std::size_t done, std::size_t all, const std::string& what);

}  // namespace binpose::paper

#include "tests/bench/paper/run_log.h"

#include <cstdio>

namespace binpose::paper {

RunLog::RunLog(const std::filesystem::path& path) {
  std::string whole;
  std::ifstream before(path);
  for (std::string line; std::getline(before, line) && !before.eof();) {  // a line cut short has no end
    keys_.insert(Json::parse(line).at("key"));
    whole += line + "\n";
  }
  before.close();
  file_.open(path, std::ios::trunc);
  file_ << whole << std::flush;
}

void RunLog::add(const std::string& key, Json entry) {
  entry["key"] = key;
  file_ << entry.dump() << std::endl;
  keys_.insert(key);
}

void show_progress(const std::string& run, std::size_t done, std::size_t all, const std::string& what) {
  std::fprintf(stderr, "%s %zu/%zu %s\n", run.c_str(), done, all, what.c_str());
}

}  // namespace binpose::paper

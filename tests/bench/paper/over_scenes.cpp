#include "tests/bench/paper/over_scenes.h"

#include <algorithm>
#include <map>

namespace binpose::paper {

namespace fs = std::filesystem;

std::vector<fs::path> scene_folders(const fs::path& scenes) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(scenes)) {
    if (fs::exists(entry.path() / "gt.json")) folders.push_back(entry.path());
  }
  const auto number_first = [](const fs::path& folder) {
    const std::string name = folder.filename();
    return std::pair(name.substr(std::min(name.size(), name.rfind('_'))), name);
  };
  std::sort(folders.begin(), folders.end(),
            [&](const fs::path& a, const fs::path& b) { return number_first(a) < number_first(b); });
  return folders;
}

void measure_over_scenes(const std::string& run, const fs::path& parts_folder, const fs::path& scenes,
                         const fs::path& output, const std::function<NamedFinders(const testing::ScenePart&)>& train,
                         Share share) {
  std::map<std::string, testing::ScenePart> parts;
  for (const testing::ScenePart& part : testing::read_parts(parts_folder)) parts.emplace(part.name, part);
  std::map<std::string, NamedFinders> trained;
  RunLog log(output);
  const std::vector<fs::path> folders = scene_folders(scenes);
  for (std::size_t i = share.index; i < folders.size(); i += share.count) {
    const std::string name = folders[i].filename();
    if (log.has(name)) continue;
    const testing::BinScene scene = testing::read_scene(folders[i]);
    const testing::ScenePart& part = parts.at(scene.part);
    NamedFinders& finders = trained[scene.part];
    if (finders.empty()) finders = train(part);
    const testing::PoseJudge judge(part);
    Json results;
    for (const auto& [what, find] : finders) results[what] = measure(find, scene, judge);
    log.add(name, {{"part", scene.part}, {"results", results}});
    show_progress(run, i + 1, folders.size(), name);
  }
}

}  // namespace binpose::paper

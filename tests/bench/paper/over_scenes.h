#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/bench/paper/measure.h"
#include "tests/bench/paper/runs.h"

namespace binpose::paper {

/// Finders by the name of what they stand for.
using NamedFinders = std::vector<std::pair<std::string, Finder>>;

/// Scene folders (with gt.json), the parts taking turns, so that a run stopped early has seen all of them.
std::vector<std::filesystem::path> scene_folders(const std::filesystem::path& scenes);

/// Runs all finders of a scene's part, one after the other, on every scene of the share that `output` does not hold
/// yet. A line of the log: "key" (the scene), "part", and "results" with the measurements of each finder.
void measure_over_scenes(const std::string& run, const std::filesystem::path& parts,
                         const std::filesystem::path& scenes, const std::filesystem::path& output,
                         const std::function<NamedFinders(const testing::ScenePart&)>& train, Share share);

}  // namespace binpose::paper

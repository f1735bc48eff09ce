// binpose-paper: the experiments of the paper's section V; paper.sh runs them all.
#include <pcl/console/print.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "tests/bench/paper/runs.h"

int main(int argc, char** argv) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // else it tells of every sample that finds no plane
  using namespace binpose::paper;                           // NOLINT
  CLI::App app("The experiments of the paper.");
  app.require_subcommand(1);
  std::filesystem::path parts, scenes, output;
  int count = 200;
  Share share;
  const auto add = [&](const char* name, const char* what, const auto& run) {
    CLI::App* command = app.add_subcommand(name, what);
    command->add_option("parts", parts, "folder with parts.json")->required()->check(CLI::ExistingDirectory);
    command->callback(run);
    return command;
  };
  const auto with_scenes = [&](CLI::App* command) {
    command->add_option("scenes", scenes, "folder of scene folders")->required()->check(CLI::ExistingDirectory);
    command->add_option("output", output)->required();
  };
  const auto with_share_of_scenes = [&](CLI::App* command) {
    with_scenes(command);
    command->add_option("--shares", share.count, "so many processes share the scenes")->check(CLI::Range(1, 100));
    command->add_option("--share", share.index, "the one of these that is this process's, from 0 on");
  };
  with_share_of_scenes(add("table", "Table I", [&] { run_table(parts, scenes, output, share); }));
  with_share_of_scenes(add("sweep", "Fig. 8 and 9", [&] { run_sweep(parts, scenes, output, share); }));
  with_scenes(add("pictures", "what Fig. 3, 6 and 7 show", [&] { write_pictures(parts, scenes, output); }));
  CLI::App* accuracy = add("accuracy", "Fig. 5", [&] { run_accuracy(parts, count, output); });
  accuracy->add_option("output", output)->required();
  accuracy->add_option("--count", count)->check(CLI::Range(1, 100000))->capture_default_str();
  try {
    CLI11_PARSE(app, argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "binpose-paper: " << error.what() << "\n";
    return 1;
  }
}

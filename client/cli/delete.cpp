#include <iostream>
#include <memory>

#include "client/cli/command.h"
#include "client/cli/json.h"

namespace binpose::client::cli {
namespace {

ExitCode delete_model(const std::string& id, const GlobalOptions& global) {
  if (absl::Status status = connect(global).delete_model(id); !status.ok()) return report_call(status);
  if (global.json) {
    std::cout << answer_json(v1::DeleteModelResponse()) << std::endl;
  } else {
    std::cout << "deleted " << id << '\n';
  }
  return kOk;
}

}  // namespace

void add_delete(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  const auto id = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("delete", "Delete a model");
  command.footer("\nExamples:\n  binpose delete gear");
  command.add_option("id", *id, "Its ID")->required();
  command.callback([&chosen, id, &global] { chosen = [id, &global] { return delete_model(*id, global); }; });
}

}  // namespace binpose::client::cli

#include <iostream>
#include <memory>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/model_text.h"

namespace binpose::client::cli {
namespace {

ExitCode show_model(const std::string& id, const GlobalOptions& global) {
  const absl::StatusOr<v1::Model> model = connect(global).get_model(id);
  if (!model.ok()) return report_call(model.status());
  if (global.json) {
    std::cout << answer_json(*model) << std::endl;
  } else {
    print(details_of(*model), std::cout);
  }
  return kOk;
}

}  // namespace

void add_model(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  const auto id = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("model", "Show one model");
  command.add_option("id", *id, "Its ID")->required();
  command.callback([&chosen, id, &global] { chosen = [id, &global] { return show_model(*id, global); }; });
}

}  // namespace binpose::client::cli

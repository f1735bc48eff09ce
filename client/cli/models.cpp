#include <iostream>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/model_text.h"

namespace binpose::client::cli {
namespace {

ExitCode list_models(const GlobalOptions& global) {
  const absl::StatusOr<v1::ListModelsResponse> models = connect(global).list_models();
  if (!models.ok()) return report_call(models.status());
  if (global.json) {
    std::cout << answer_json(*models) << std::endl;
  } else if (models->models().empty()) {
    std::cout << "no models at " << global.server << "; make one with `binpose train`\n";
  } else {
    print(table_of(*models), std::cout);
  }
  return kOk;
}

}  // namespace

void add_models(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  CLI::App& command = *app.add_subcommand("models", "List the models");
  command.footer("\nExamples:\n  binpose models\n  binpose models --json | jq -r .models[].id");
  command.callback([&chosen, &global] { chosen = [&global] { return list_models(global); }; });
}

}  // namespace binpose::client::cli

#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/model_text.h"
#include "client/cli/page.h"

namespace binpose::client::cli {
namespace {

struct ModelOptions {
  std::string id;
  std::optional<std::string> page;
};

absl::Status write_model_page(const std::string& path, const v1::Model& model, const v1::GetModelShapeResponse& shape) {
  return write_page(path,
                    R"({"kind":"model","model":)" + answer_json(model) + ",\"shape\":" + request_json(shape) + "}");
}

ExitCode show_model(const ModelOptions& options, const GlobalOptions& global) {
  Client client = connect(global);
  const absl::StatusOr<v1::Model> model = client.get_model(options.id);
  if (!model.ok()) return report_call(model.status());
  if (options.page.has_value()) {
    const absl::StatusOr<v1::GetModelShapeResponse> shape = client.get_model_shape(options.id);
    if (!shape.ok()) return report_call(shape.status());
    if (absl::Status status = write_model_page(*options.page, *model, *shape); !status.ok()) {
      report(status);
      return kUnreadable;
    }
  }
  if (global.json) {
    std::cout << answer_json(*model) << std::endl;
  } else {
    print(details_of(*model), std::cout);
  }
  return kOk;
}

}  // namespace

void add_model(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  const auto options = std::make_shared<ModelOptions>();
  CLI::App& command = *app.add_subcommand("model", "Show one model");
  command.footer("\nExamples:\n  binpose model gear\n  binpose model gear --view gear.html");
  command.add_option("id", options->id, "Its ID")->required();
  add_view(command, options->page, "Also draw the model into this HTML file, to be opened in a browser");
  command.callback(
      [&chosen, options, &global] { chosen = [options, &global] { return show_model(*options, global); }; });
}

}  // namespace binpose::client::cli

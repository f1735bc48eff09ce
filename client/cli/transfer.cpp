#include <google/protobuf/struct.pb.h>

#include <fstream>
#include <iostream>
#include <memory>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/model_text.h"
#include "client/read_file.h"

namespace binpose::client::cli {
namespace {

struct Options {
  std::string id;
  std::string file;
};

ExitCode export_model(const Options& options, const GlobalOptions& global) {
  const absl::StatusOr<std::string> bytes = connect(global).export_model(options.id);
  if (!bytes.ok()) return report_call(bytes.status());
  std::ofstream file(options.file, std::ios::binary);
  if (!file.write(bytes->data(), static_cast<std::streamsize>(bytes->size())).flush()) {
    report(absl::InternalError("Cannot write " + options.file + "."));
    return kUnreadable;
  }
  if (global.json) {
    google::protobuf::Struct written;
    (*written.mutable_fields())["file"].set_string_value(options.file);
    (*written.mutable_fields())["fileBytes"].set_number_value(static_cast<double>(bytes->size()));
    std::cout << answer_json(written) << std::endl;
  } else {
    std::cout << "exported " << options.id << " to " << options.file << '\n';
  }
  return kOk;
}

ExitCode import_model(const Options& options, const GlobalOptions& global) {
  const absl::StatusOr<std::string> bytes = read_file(options.file);
  if (!bytes.ok()) {
    report(bytes.status());
    return kUnreadable;
  }
  const absl::StatusOr<v1::Model> model = connect(global).import_model(options.id, *bytes);
  if (!model.ok()) return report_call(model.status());
  if (global.json) {
    std::cout << answer_json(*model) << std::endl;
  } else {
    print(details_of(*model), std::cout);
  }
  return kOk;
}

void add(CLI::App& app, const std::string& name, const char* help, const GlobalOptions& global, Command& chosen,
         ExitCode (*run)(const Options&, const GlobalOptions&)) {
  const auto options = std::make_shared<Options>();
  CLI::App& command = *app.add_subcommand(name, help);
  command.footer("\nExamples:\n  binpose " + name + " gear gear.model");
  command.add_option("id", options->id, "Its ID")->required();
  command.add_option("file", options->file, "The model file")->required();
  command.callback([&chosen, options, &global, run] { chosen = [=, &global] { return run(*options, global); }; });
}

}  // namespace

void add_export(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  add(app, "export", "Fetch a model as a file", global, chosen, export_model);
}

void add_import(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  add(app, "import", "Give a model's file to the server", global, chosen, import_model);
}

}  // namespace binpose::client::cli

#include "client/cli/result_page.h"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include "client/cli/choice.h"
#include "client/cli/json.h"
#include "client/cli/page.h"
#include "client/read_file.h"

namespace binpose::client::cli {
namespace {

/// What the page knows of a model: {model, shape, and its mesh if there is one}.
absl::StatusOr<std::string> model_json(const ResultPageOptions& options, const v1::DetectRequest& request, int i,
                                       Client& client) {
  const std::string& id = request.model_ids(i);
  const absl::StatusOr<v1::Model> model = client.get_model(id);
  if (!model.ok()) return model.status();
  std::string json = "{\"model\":" + answer_json(*model);
  if (static_cast<std::size_t>(i) < options.meshes.size()) {
    absl::StatusOr<std::string> bytes = read_file(options.meshes[i]);
    if (!bytes.ok()) return bytes.status();
    v1::Mesh mesh;
    mesh.set_data(*std::move(bytes));
    mesh.set_unit(options.mesh_unit);
    return json + ",\"mesh\":" + request_json(mesh) + "}";
  }
  const absl::StatusOr<v1::GetModelShapeResponse> shape = client.get_model_shape(id);
  if (!shape.ok()) return shape.status();
  return json + ",\"shape\":" + request_json(*shape) + "}";
}

/// Checks a file of true poses; returns its text.
absl::StatusOr<std::string> read_truth(const std::string& path) {
  absl::StatusOr<std::string> text = read_file(path);
  if (!text.ok()) return text.status();
  google::protobuf::Struct object;
  const absl::Status wrong = absl::InvalidArgumentError(
      path + " holds no true poses; expected is {\"instances\": [{\"pose\": [16 numbers, row by row, in mm]}, ...]}.");
  if (!google::protobuf::util::JsonStringToMessage(*text, &object).ok()) return wrong;
  const auto instances = object.fields().find("instances");
  if (instances == object.fields().end()) return wrong;
  for (const google::protobuf::Value& instance : instances->second.list_value().values()) {
    const auto pose = instance.struct_value().fields().find("pose");
    if (pose == instance.struct_value().fields().end() || pose->second.list_value().values_size() != 16) return wrong;
  }
  return text;
}

}  // namespace

void add_result_page_options(CLI::App& command, ResultPageOptions& options) {
  CLI::Option* page = add_view(command, options.page,
                               "Also draw the result, of one scene, into this HTML file, to be opened in a browser");
  CLI::Option* mesh =
      command.add_option("--mesh", options.meshes, "Meshes of the parts, in the order of --model, to draw them with")
          ->type_name("FILE...")
          ->needs(page);
  CLI::Option* unit =
      add_choice<v1::LengthUnit>(command, "--mesh-unit", options.mesh_unit, length_units(), "Unit of these meshes");
  mesh->needs(unit);
  command
      .add_option("--truth", options.truth,
                  "True poses to draw: {\"instances\": [{\"pose\": [16 numbers, row by row, mm]}]}")
      ->type_name("FILE")
      ->needs(page);
}

absl::Status write_result_page(const ResultPageOptions& options, const v1::DetectRequest& request,
                               const v1::DetectResponse& answer, Client& client) {
  std::string models;
  for (int i = 0; i < request.model_ids_size(); ++i) {
    const absl::StatusOr<std::string> model = model_json(options, request, i, client);
    if (!model.ok()) return model.status();
    models += (models.empty() ? "" : ",") + *model;
  }
  std::string truth = "null";
  if (options.truth.has_value()) {
    const absl::StatusOr<std::string> text = read_truth(*options.truth);
    if (!text.ok()) return text.status();
    truth = *text;
  }
  return write_page(*options.page, "{\"kind\":\"result\",\"request\":" + request_json(request) + ",\"answer\":" +
                                       answer_json(answer) + ",\"models\":[" + models + "],\"truth\":" + truth + "}");
}

}  // namespace binpose::client::cli

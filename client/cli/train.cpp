#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>

#include "client/cli/choice.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/model_text.h"
#include "client/cli/progress.h"
#include "client/cli/style.h"
#include "client/cli/table.h"
#include "client/read_file.h"

namespace binpose::client::cli {
namespace {

/// Absent means the server's default.
struct TrainOptions {
  std::string id;
  std::string mesh;
  v1::LengthUnit unit = v1::LENGTH_UNIT_UNSPECIFIED;
  v1::TrainPreset preset = v1::TRAIN_PRESET_UNSPECIFIED;
  v1::PairSelection selection = v1::PAIR_SELECTION_UNSPECIFIED;
  std::vector<std::pair<double, double>> pair_lengths;
  std::optional<double> relative_sampling;
  std::optional<double> bin_width_degrees;
  std::optional<std::uint32_t> viewpoint_count;
  std::optional<double> pairs_per_point;
  std::optional<double> observability_weight;
  std::optional<double> distinctiveness_weight;
};

void add_options(CLI::App& command, TrainOptions& options) {
  command.add_option("--id", options.id, "Name of the model: letters, digits, . _ -")->required();
  command.add_option("--mesh", options.mesh, "STL, PLY or OBJ file")->required()->type_name("FILE");
  add_unit(command, options.unit, "Unit of the mesh");
  add_choice<v1::TrainPreset>(command, "--preset", options.preset,
                              {{"default", v1::TRAIN_PRESET_DEFAULT}, {"paper", v1::TRAIN_PRESET_PAPER}},
                              "Base that the other options change");
  add_choice<v1::PairSelection>(command, "--selection", options.selection,
                                {{"distinctiveness", v1::PAIR_SELECTION_DISTINCTIVENESS},
                                 {"observability", v1::PAIR_SELECTION_OBSERVABILITY},
                                 {"integration", v1::PAIR_SELECTION_INTEGRATION},
                                 {"signal-to-noise", v1::PAIR_SELECTION_SIGNAL_TO_NOISE}},
                                "How vector pairs are ranked");
  command.add_option("--pair-lengths", options.pair_lengths, "Lengths of a pair's vectors as shares of the diameter")
      ->type_name("Q1 Q2");
  command.add_option("--relative-sampling", options.relative_sampling, "Point spacing as a share of the diameter");
  command.add_option("--bin-width", options.bin_width_degrees, "Width of a feature bin, degrees");
  command.add_option("--viewpoints", options.viewpoint_count, "Number of viewpoints K");
  command.add_option("--pairs-per-point", options.pairs_per_point, "Vector pairs kept, per model point");
  command.add_option("--observability-weight", options.observability_weight, "Weight w1 of the integration");
  command.add_option("--distinctiveness-weight", options.distinctiveness_weight, "Weight w2 of the integration");
}

v1::TrainRequest make_request(const TrainOptions& options, std::string mesh) {
  v1::TrainRequest request;
  request.set_id(options.id);
  request.mutable_mesh()->set_data(std::move(mesh));
  request.mutable_mesh()->set_unit(options.unit);
  v1::TrainParams& params = *request.mutable_params();
  params.set_preset(options.preset);
  params.set_selection(options.selection);
  for (const auto& [q1, q2] : options.pair_lengths) {
    v1::PairLengths& lengths = *params.add_pair_lengths();
    lengths.set_relative_q1(q1);
    lengths.set_relative_q2(q2);
  }
  if (options.relative_sampling) params.set_relative_sampling(*options.relative_sampling);
  if (options.bin_width_degrees) params.set_bin_width_degrees(*options.bin_width_degrees);
  if (options.viewpoint_count) params.set_viewpoint_count(*options.viewpoint_count);
  if (options.pairs_per_point) params.set_pairs_per_point(*options.pairs_per_point);
  if (options.observability_weight) params.set_observability_weight(*options.observability_weight);
  if (options.distinctiveness_weight) params.set_distinctiveness_weight(*options.distinctiveness_weight);
  return request;
}

const char* text_of(v1::TrainStage stage) {
  switch (stage) {
    case v1::TRAIN_STAGE_QUEUED:
      return "waiting for a free worker";
    case v1::TRAIN_STAGE_READING_MESH:
      return "reading the mesh";
    case v1::TRAIN_STAGE_SAMPLING:
      return "sampling the surface";
    case v1::TRAIN_STAGE_VISIBILITY:
      return "what each viewpoint sees";
    case v1::TRAIN_STAGE_VECTOR_PAIRS:
      return "vector pairs";
    case v1::TRAIN_STAGE_SYMMETRY:
      return "symmetry";
    case v1::TRAIN_STAGE_SAVING:
      return "saving";
    default:
      return "";
  }
}

void show_progress(const v1::TrainResponse& progress) {
  if (progress.has_model()) return clear_progress();
  draw_progress(progress.progress(), text_of(progress.stage()));
}

ExitCode train(const TrainOptions& options, const GlobalOptions& global) {
  absl::StatusOr<std::string> mesh = read_file(options.mesh);
  if (!mesh.ok()) {
    report(mesh.status());
    return kUnreadable;
  }
  const bool has_bar = is_terminal(stderr);
  const auto begin = std::chrono::steady_clock::now();
  Client client = connect(global);
  const absl::StatusOr<v1::Model> model =
      client.train(make_request(options, *std::move(mesh)), has_bar ? TrainObserver(show_progress) : TrainObserver());
  if (!model.ok()) {
    if (has_bar) std::cerr << '\n';
    return report_call(model.status());
  }
  if (global.json) {
    std::cout << answer_json(*model) << std::endl;
    return kOk;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::cout << "trained " << model->id() << " in " << fixed(took.count(), 1) << " s\n";
  print(details_of(*model), std::cout);
  return kOk;
}

}  // namespace

void add_train(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  const auto options = std::make_shared<TrainOptions>();
  CLI::App& command = *app.add_subcommand("train", "Make a model of a part from its CAD mesh");
  command.footer(R"(
A model of the same ID is replaced, once the new one is saved.

Examples:
  binpose train --id gear --mesh gear.stl --unit mm
  binpose train --id gear --mesh gear.stl --unit mm --preset paper --selection observability)");
  add_options(command, *options);
  command.callback([&chosen, options, &global] { chosen = [options, &global] { return train(*options, global); }; });
}

}  // namespace binpose::client::cli

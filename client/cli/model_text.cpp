#include "client/cli/model_text.h"

#include <google/protobuf/util/time_util.h>

namespace binpose::client::cli {
namespace {

constexpr double kMillimetres = 1000;

std::string symmetry_text(const v1::Symmetry& symmetry) {
  const std::string count = std::to_string(symmetry.discrete_size());
  if (symmetry.has_axis()) return symmetry.discrete_size() > 1 ? "axis, " + count + " poses" : "axis";
  return symmetry.discrete_size() > 1 ? count + " poses" : "none";
}

std::string time_text(const v1::Model& model) {
  // To the second: "2024-05-01T12:00:00Z".
  return google::protobuf::util::TimeUtil::ToString(
      google::protobuf::util::TimeUtil::SecondsToTimestamp(model.create_time().seconds()));
}

std::string box_text(const v1::Model& model) {
  const v1::Vector3& low = model.bounding_box_min();
  const v1::Vector3& high = model.bounding_box_max();
  return fixed(kMillimetres * (high.x() - low.x()), 1) + " x " + fixed(kMillimetres * (high.y() - low.y()), 1) + " x " +
         fixed(kMillimetres * (high.z() - low.z()), 1) + " mm";
}

}  // namespace

Table table_of(const v1::ListModelsResponse& models) {
  Table table = {{"id", "diameter mm", "symmetry", "points", "pairs", "KiB", "generation", "trained"}};
  for (const v1::Model& model : models.models()) {
    table.push_back({model.id(), fixed(kMillimetres * model.diameter(), 1), symmetry_text(model.symmetry()),
                     std::to_string(model.point_count()), std::to_string(model.pair_count()),
                     fixed(model.file_bytes() / 1024.0, 0), std::to_string(model.generation()), time_text(model)});
  }
  return table;
}

Table details_of(const v1::Model& model) {
  Table table = {{"id", model.id()},
                 {"diameter", fixed(kMillimetres * model.diameter(), 1) + " mm"},
                 {"box", box_text(model)},
                 {"symmetry", symmetry_text(model.symmetry())},
                 {"points", std::to_string(model.point_count())},
                 {"pairs", std::to_string(model.pair_count())},
                 {"file", fixed(model.file_bytes() / 1024.0, 0) + " KiB"},
                 {"generation", std::to_string(model.generation())},
                 {"trained", time_text(model)},
                 {"content hash", model.content_hash()}};
  for (const std::string& warning : model.warnings()) table.push_back({"warning", warning});
  return table;
}

}  // namespace binpose::client::cli

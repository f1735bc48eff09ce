#include "server/convert_training.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_format.h"
#include "core/io/read_mesh.h"
#include "server/convert_geometry.h"
#include "server/decode_time.h"
#include "server/status.h"

namespace binpose::server {
namespace {

using server::to_proto;

absl::StatusOr<TrainParams> preset(v1::TrainPreset preset) {
  switch (preset) {
    case v1::TRAIN_PRESET_UNSPECIFIED:
    case v1::TRAIN_PRESET_DEFAULT:
      return TrainParams();
    case v1::TRAIN_PRESET_PAPER:
      return TrainParams::paper();
    default:
      return absl::InvalidArgumentError(absl::StrFormat("params.preset is %d; no such preset exists.", preset));
  }
}

absl::Status set_selection(v1::PairSelection selection, TrainParams& params) {
  switch (selection) {
    case v1::PAIR_SELECTION_UNSPECIFIED:
      return absl::OkStatus();
    case v1::PAIR_SELECTION_DISTINCTIVENESS:
      params.selection = PairSelection::kDistinctiveness;
      return absl::OkStatus();
    case v1::PAIR_SELECTION_OBSERVABILITY:
      params.selection = PairSelection::kObservability;
      return absl::OkStatus();
    case v1::PAIR_SELECTION_INTEGRATION:
      params.selection = PairSelection::kIntegration;
      return absl::OkStatus();
    case v1::PAIR_SELECTION_SIGNAL_TO_NOISE:
      params.selection = PairSelection::kSignalToNoise;
      return absl::OkStatus();
    default:
      return absl::InvalidArgumentError(
          absl::StrFormat("params.selection is %d; no such selection exists.", selection));
  }
}

absl::StatusOr<MeshFormat> to_format(v1::MeshFormat format) {
  switch (format) {
    case v1::MESH_FORMAT_UNSPECIFIED:
      return MeshFormat::kDetect;
    case v1::MESH_FORMAT_STL:
      return MeshFormat::kStl;
    case v1::MESH_FORMAT_PLY:
      return MeshFormat::kPly;
    case v1::MESH_FORMAT_OBJ:
      return MeshFormat::kObj;
    default:
      return absl::InvalidArgumentError(absl::StrFormat("mesh.format is %d; no such format exists.", format));
  }
}

v1::Symmetry to_proto(const Symmetry& symmetry) {
  v1::Symmetry message;
  for (const Pose& pose : symmetry.discrete) *message.add_discrete() = to_proto(pose, 1);
  if (symmetry.has_axis) {
    *message.mutable_axis()->mutable_point() = to_proto(symmetry.axis_point);
    *message.mutable_axis()->mutable_direction() = to_proto(symmetry.axis_direction);
  }
  return message;
}

}  // namespace

absl::StatusOr<TrainParams> to_train_params(const v1::TrainParams& message) {
  absl::StatusOr<TrainParams> params = preset(message.preset());
  if (!params.ok()) return params;
  if (absl::Status status = set_selection(message.selection(), *params); !status.ok()) return status;
  if (message.has_relative_sampling()) params->relative_sampling = message.relative_sampling();
  if (!message.pair_lengths().empty()) params->pair_lengths.clear();
  for (const v1::PairLengths& lengths : message.pair_lengths()) {
    params->pair_lengths.push_back({lengths.relative_q1(), lengths.relative_q2()});
  }
  if (message.has_bin_width_degrees()) params->bin_width = message.bin_width_degrees() * kDegree;
  if (message.has_viewpoint_count()) params->viewpoint_count = saturate(message.viewpoint_count());
  if (message.has_pairs_per_point()) params->pairs_per_point = message.pairs_per_point();
  if (message.has_observability_weight()) params->observability_weight = message.observability_weight();
  if (message.has_distinctiveness_weight()) params->distinctiveness_weight = message.distinctiveness_weight();
  if (absl::Status status = validate(*params); !status.ok()) return status;
  return params;
}

absl::StatusOr<Mesh> to_mesh(const v1::Mesh& message, const RunControl& control) {
  const absl::StatusOr<double> metres = metres_per_unit("mesh.unit", message.unit());
  if (!metres.ok()) return metres.status();
  const absl::StatusOr<MeshFormat> format = to_format(message.format());
  if (!format.ok()) return format.status();
  return decode_in_time("mesh.data", control, [&](const RunControl& limited) {
    return in_field("mesh.data", read_mesh(message.data(), *format, *metres, {}, limited));
  });
}

std::optional<std::string> doubt_unit(double diameter, v1::LengthUnit unit) {
  // What lies in bins and what sensors resolve, with room to spare; a mix-up is a factor of 1000.
  constexpr double kSmallest = 0.002;
  constexpr double kLargest = 3;
  if (diameter >= kSmallest && diameter <= kLargest) return std::nullopt;
  return absl::StrFormat("The part measures %g m across, where %g m to %g m is usual; is mesh.unit = %s right?",
                         diameter, kSmallest, kLargest, v1::LengthUnit_Name(unit));
}

v1::TrainStage to_proto(TrainStage stage) {
  switch (stage) {
    case TrainStage::kSampling:
      return v1::TRAIN_STAGE_SAMPLING;
    case TrainStage::kVisibility:
      return v1::TRAIN_STAGE_VISIBILITY;
    case TrainStage::kVectorPairs:
      return v1::TRAIN_STAGE_VECTOR_PAIRS;
    case TrainStage::kSymmetry:
      return v1::TRAIN_STAGE_SYMMETRY;
  }
  return v1::TRAIN_STAGE_UNSPECIFIED;
}

v1::Model to_proto(const StoredModel& stored) {
  const Model& model = stored.model;
  v1::Model message;
  message.set_id(stored.id);
  message.set_diameter(model.diameter);
  *message.mutable_symmetry() = to_proto(model.symmetry);
  message.set_generation(stored.generation);
  message.set_content_hash(stored.content_hash);
  *message.mutable_bounding_box_min() = to_proto(model.box_min);
  *message.mutable_bounding_box_max() = to_proto(model.box_max);
  message.set_point_count(static_cast<std::uint32_t>(model.pair_points.size()));
  message.set_pair_count(static_cast<std::uint32_t>(model.pairs.size()));
  message.set_file_bytes(static_cast<std::uint32_t>(stored.file_bytes));
  message.mutable_create_time()->set_seconds(stored.create_time.time_since_epoch().count());
  for (const std::string& warning : model.warnings) message.add_warnings(warning);
  for (const Pose& pose : model.similar_poses) *message.add_similar_poses() = to_proto(pose, 1);
  return message;
}

}  // namespace binpose::server

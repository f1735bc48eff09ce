#include "server/convert_search_space.h"

#include <algorithm>

#include "absl/strings/str_format.h"
#include "core/params.h"
#include "server/convert_geometry.h"

namespace binpose::server {
namespace {

absl::StatusOr<OrientedBox> to_box(std::string_view field, const v1::OrientedBox& message, double metres_per_unit) {
  absl::StatusOr<Pose> pose = to_pose(absl::StrFormat("%s.pose", field), message.pose(), metres_per_unit);
  if (!pose.ok()) return pose.status();
  return OrientedBox{*pose, metres_per_unit * to_vector(message.size())};
}

absl::StatusOr<PosePrior> to_prior(const v1::PosePrior& message,
                                   const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                                   double metres_per_unit) {
  PosePrior prior;
  if (!message.model_id().empty()) {
    const auto found = std::find(model_ids.begin(), model_ids.end(), message.model_id());
    if (found == model_ids.end()) {
      return absl::InvalidArgumentError(
          absl::StrFormat("priors.model_id is '%s'; it must be one of the request's model_ids.", message.model_id()));
    }
    prior.model_index = static_cast<int>(found - model_ids.begin());
  }
  // A vector of length 0 stays one, which core refuses.
  if (message.has_model_direction()) prior.model_direction = to_vector(message.model_direction()).stableNormalized();
  if (message.has_scene_direction()) prior.scene_direction = to_vector(message.scene_direction()).stableNormalized();
  if (message.has_max_angle_degrees()) prior.max_angle = message.max_angle_degrees() * kDegree;
  if (message.has_min_distance()) prior.min_distance = metres_per_unit * message.min_distance();
  if (message.has_max_distance()) prior.max_distance = metres_per_unit * message.max_distance();
  return prior;
}

}  // namespace

absl::StatusOr<SearchSpace> to_search_space(const v1::DetectParams& message,
                                            const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                                            double metres_per_unit) {
  SearchSpace space;
  for (const v1::OrientedBox& region : message.regions()) {
    const absl::StatusOr<OrientedBox> box = to_box("regions", region, metres_per_unit);
    if (!box.ok()) return box.status();
    space.regions.push_back(*box);
  }
  if (message.has_bin_interior()) {
    const absl::StatusOr<OrientedBox> box = to_box("bin_interior", message.bin_interior(), metres_per_unit);
    if (!box.ok()) return box.status();
    space.bin_interior = *box;
  }
  if (message.has_support_plane()) {
    space.support_plane = Plane{to_vector(message.support_plane().normal()).stableNormalized(),
                                metres_per_unit * message.support_plane().offset()};
  }
  for (const v1::PosePrior& prior : message.priors()) {
    const absl::StatusOr<PosePrior> converted = to_prior(prior, model_ids, metres_per_unit);
    if (!converted.ok()) return converted.status();
    space.priors.push_back(*converted);
  }
  return space;
}

}  // namespace binpose::server

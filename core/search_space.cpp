#include "core/search_space.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"

namespace binpose {
namespace {

constexpr std::size_t kMostRegions = 64;
constexpr double kLongest = 1000;  // metres

const PosePrior* prior_of(const SearchSpace& space, int model_index) {
  const auto prior = std::find_if(space.priors.begin(), space.priors.end(),
                                  [&](const PosePrior& p) { return p.model_index == model_index; });
  return prior == space.priors.end() ? nullptr : &*prior;
}

absl::Status validate(std::string_view field, const OrientedBox& box) {
  if (!box.T_scene_box.matrix().allFinite() || box.T_scene_box.translation().cwiseAbs().maxCoeff() > kLongest) {
    return absl::InvalidArgumentError(
        absl::StrFormat("%s.pose must be finite and within %g m of the origin.", field, kLongest));
  }
  if (!(box.size.array() > 0).all() || !(box.size.array() <= kLongest).all()) {
    return absl::InvalidArgumentError(absl::StrFormat("%s.size is (%g, %g, %g) m; each must be above 0 and at most %g.",
                                                      field, box.size.x(), box.size.y(), box.size.z(), kLongest));
  }
  return absl::OkStatus();
}

absl::Status validate_direction(std::string_view field, const Eigen::Vector3d& direction) {
  if (std::abs(direction.norm() - 1) <= 1e-6) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat("%s is (%g, %g, %g); it must be a direction, not 0.", field,
                                                    direction.x(), direction.y(), direction.z()));
}

absl::Status validate(const PosePrior& prior) {
  if (absl::Status s = validate_direction("priors.model_direction", prior.model_direction); !s.ok()) return s;
  if (absl::Status s = validate_direction("priors.scene_direction", prior.scene_direction); !s.ok()) return s;
  if (!(prior.max_angle > 0 && prior.max_angle <= std::numbers::pi)) {
    return absl::InvalidArgumentError(absl::StrFormat("priors.max_angle_degrees is %g; it must lie in (0, 180].",
                                                      prior.max_angle * 180 / std::numbers::pi));
  }
  if (!(prior.min_distance >= 0 && prior.min_distance < prior.max_distance)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("priors.min_distance is %g m and max_distance is %g m; they must be in order and not below 0.",
                        prior.min_distance, prior.max_distance));
  }
  return absl::OkStatus();
}

}  // namespace

bool in_a_region(const SearchSpace& space, const Eigen::Vector3d& p_scene, double slack) {
  return space.regions.empty() ||
         std::any_of(space.regions.begin(), space.regions.end(),
                     [&](const OrientedBox& region) { return region.contains(p_scene, slack); });
}

Pose turned_to_prior(const SearchSpace& space, int model_index, const Symmetry& symmetry, const Pose& T_scene_model) {
  const PosePrior* prior = prior_of(space, model_index);
  if (prior == nullptr) return T_scene_model;
  return best_equivalent(T_scene_model, symmetry, prior->model_direction * prior->scene_direction.transpose());
}

bool allows(const SearchSpace& space, int model_index, const Symmetry& symmetry, const Eigen::Vector3d& centre,
            const Pose& T_scene_model, const Eigen::Vector3d& sensor_position, const Slack& slack) {
  const Eigen::Vector3d place = T_scene_model * centre;
  if (!in_a_region(space, place, slack.distance)) return false;
  const PosePrior* prior = prior_of(space, model_index);
  if (prior == nullptr) return true;
  const double distance = (place - sensor_position).norm();
  if (distance < prior->min_distance - slack.distance || distance > prior->max_distance + slack.distance) return false;
  const double widest = prior->max_angle + slack.angle;
  if (widest >= std::numbers::pi) return true;
  const Pose turned = turned_to_prior(space, model_index, symmetry, T_scene_model);
  return prior->scene_direction.dot(turned.linear() * prior->model_direction) >= std::cos(widest);
}

absl::Status validate(const SearchSpace& space) {
  if (space.regions.size() > kMostRegions) {
    return absl::InvalidArgumentError(
        absl::StrFormat("regions has %d entries; it may have %d.", space.regions.size(), kMostRegions));
  }
  for (const OrientedBox& region : space.regions) {
    if (absl::Status status = validate("regions", region); !status.ok()) return status;
  }
  if (space.bin_interior) {
    if (absl::Status status = validate("bin_interior", *space.bin_interior); !status.ok()) return status;
  }
  if (space.support_plane) {
    if (absl::Status s = validate_direction("support_plane.normal", space.support_plane->normal); !s.ok()) return s;
    if (!(std::abs(space.support_plane->offset) <= kLongest)) {
      return absl::InvalidArgumentError(absl::StrFormat("support_plane.offset is %g m; it must lie within %g.",
                                                        space.support_plane->offset, kLongest));
    }
  }
  for (const PosePrior& prior : space.priors) {
    if (absl::Status status = validate(prior); !status.ok()) return status;
    if (prior_of(space, prior.model_index) != &prior) {
      return absl::InvalidArgumentError("priors has two entries for one model; it may have one a model.");
    }
  }
  return absl::OkStatus();
}

}  // namespace binpose

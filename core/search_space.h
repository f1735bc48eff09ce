#pragma once

#include <Eigen/Core>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "core/geometry/pose.h"
#include "core/symmetry.h"

namespace binpose {

/// A box around the origin of its own frame.
struct OrientedBox {
  Pose T_scene_box = Pose::Identity();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< along the axes of the box, metres

  bool operator==(const OrientedBox& other) const {
    return T_scene_box.matrix() == other.T_scene_box.matrix() && size == other.size;
  }

  /// A point of the scene in the box's frame.
  Eigen::Vector3d in_box(const Eigen::Vector3d& p_scene) const {
    return T_scene_box.linear().transpose() * (p_scene - T_scene_box.translation());
  }
  /// Whether a point lies inside, or outside by at most `slack` metres along each axis.
  bool contains(const Eigen::Vector3d& p_scene, double slack = 0) const {
    return (in_box(p_scene).cwiseAbs().array() <= 0.5 * size.array() + slack).all();
  }
};

/// normal . p = offset; the normal, of unit length, points to the side where the parts are.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0;  ///< metres

  bool operator==(const Plane&) const = default;
};

/// How one model's parts can lie. Whichever of its symmetric equivalents fits counts.
struct PosePrior {
  int model_index = 0;                                         ///< into the models that are searched for
  Eigen::Vector3d model_direction = Eigen::Vector3d::UnitZ();  ///< unit; lies ...
  Eigen::Vector3d scene_direction = Eigen::Vector3d::UnitZ();  ///< ... within max_angle of this one, unit
  double max_angle = std::numbers::pi;                         ///< radians, (0, pi]; pi = any
  double min_distance = 0;                                     ///< of the part's centre from the sensor, metres
  double max_distance = std::numeric_limits<double>::infinity();

  bool operator==(const PosePrior&) const = default;
};

/// What is known beforehand of where parts are; scene frame. Default: nothing.
struct SearchSpace {
  std::vector<OrientedBox> regions;    ///< a part's centre lies in one of them; none = anywhere
  std::optional<Plane> support_plane;  ///< what lies on it or under it is no part
  std::optional<OrientedBox>
      bin_interior;               ///< open at its +z side; its walls, its floor and what is outside are no parts
  std::vector<PosePrior> priors;  ///< at most one a model

  bool operator==(const SearchSpace&) const = default;
};

/// How far a pose that is only guessed yet may be off.
struct Slack {
  double distance = 0;  ///< metres
  double angle = 0;     ///< radians
};

/// Whether a point lies in one of the regions, or outside by at most `slack` metres; where there are none, anywhere.
bool in_a_region(const SearchSpace& space, const Eigen::Vector3d& p_scene, double slack);

/// The symmetric equivalent of a pose that suits the prior of its model best; the pose itself where there is none.
Pose turned_to_prior(const SearchSpace& space, int model_index, const Symmetry& symmetry, const Pose& T_scene_model);

/// Whether a part may lie so.
/// @param centre  of the part, model frame.
bool allows(const SearchSpace& space, int model_index, const Symmetry& symmetry, const Eigen::Vector3d& centre,
            const Pose& T_scene_model, const Eigen::Vector3d& sensor_position, const Slack& slack = {});

/// OK, or INVALID_ARGUMENT with a sentence that names field, value and range.
absl::Status validate(const SearchSpace& space);

}  // namespace binpose

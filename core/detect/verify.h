#pragma once

#include <limits>

#include "core/geometry/depth_map.h"
#include "core/model.h"

namespace binpose {

/// Surface seen under less than this cosine (75 degrees) is left out: sensors often get no echo from it.
inline constexpr float kSteepest = 0.25882F;

/// How closely scene and model must agree.
struct VerifyOptions {
  float tolerance = 0;                                ///< metres along the normal
  float normal_cosine = 0.8F;                         ///< least cosine between scene and model normal
  int most_points = std::numeric_limits<int>::max();  ///< check only a prefix of the view's points
  int outline_stride = 1;                             ///< and every n-th of its outline
};

/// What the sensor saw of the surface that a pose says it should see. Shares of all points visible from that side.
struct Evidence {
  float explained = 0;             ///< measured where the model is
  float violated = 0;              ///< measured clearly behind: the sensor looked through the model
  float occluded = 0;              ///< measured clearly in front: something hides the model
  float unexplained = 0;           ///< measured near, with another normal
  float outline_confirmed = 0;     ///< of the outline points: the surface is there and ends, or is not measured beyond
  float outline_contradicted = 0;  ///< of the outline points: the surface goes on, or is missing
  float outline_weight = 1;        ///< below 1 where the pixels are too coarse to tell where an outline runs
  float area = 0;                  ///< of the explained surface across the view, over the part's mean over all views
  float residual = 0;              ///< root mean square distance of the explained points, metres
  float relative_residual = 0;     ///< over what the sensor's noise explains

  /// How sure the pose is, in [0, 1]: the explained share less what the scene contradicts, what is hidden being excused
  /// in part; times the share of the outline that is where it should be; less where the surface fits worse than noise
  /// explains, or where so little of it is seen that chance may have made it. The weights were fitted on which poses of
  /// simulated bins are right.
  float score() const { return score_with_outline(outline_weight); }
  /// The same with coarse pixels excused but in part: in doubt, a surface without the outline is weak proof.
  float strict_score() const { return score_with_outline((2 + outline_weight) / 3); }
  /// Ranks poses that are not refined yet. So far off, most of them contradict the scene enough that their score is 0;
  /// this goes on telling them apart.
  float promise() const;

 private:
  float score_with_outline(float weight) const;
};

/// The paper's alignment error as a score [section IV 5]: one less the mean distance of all model points, whether the
/// sensor could see them or not, to the scene along the ray, each cut off at `cutoff` metres and given as a share of
/// it.
float alignment_score(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model, float cutoff);

/// The viewpoint of training nearest to a viewer at the origin.
int nearest_viewpoint(const Model& model, const Eigen::Isometry3f& T_view_model);

/// The points of the model that a viewer at the origin sees of it, as a list into Model::surface.
inline const std::vector<std::uint16_t>& visible_points(const Model& model, const Eigen::Isometry3f& T_view_model) {
  return model.visible_from[nearest_viewpoint(model, T_view_model)];
}

/// Compares the visible surface of a pose with the depth map, point by point.
///
/// Pixels of the background explain nothing.
/// @param owner  per pixel the better hypothesis that explains it already, which leaves it unexplained here, or -1; or
/// null.
Evidence verify(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                const VerifyOptions& options, const std::vector<int>* owner = nullptr);

}  // namespace binpose

#include "core/detect/describe.h"

#include "core/detect/uncertainty.h"

namespace binpose {
namespace {

/// Of the poses that show the same surface, the one that the caller would rather have.
Pose preferred(const Pose& T_scene_model, const Symmetry& symmetry, int model_index, const DetectParams& params) {
  if (!params.reference_orientation) return turned_to_prior(params.space, model_index, symmetry, T_scene_model);
  return best_equivalent(T_scene_model, symmetry, params.reference_orientation->toRotationMatrix().transpose());
}

/// How well the scene determines the pose, in scene axes, told of the pose's position.
void add_uncertainty(const Candidate& candidate, const DepthMap& map, const Model& model, const VerifyOptions& options,
                     PoseHypothesis& hypothesis) {
  const Uncertainty uncertainty =
      uncertainty_of(map, model, candidate.T_view_model, options, candidate.evidence.residual);
  Matrix6d to_scene = Matrix6d::Zero();
  to_scene.topLeftCorner<3, 3>() = to_scene.bottomRightCorner<3, 3>() = map.T_scene_view.linear();
  const Eigen::Vector3d centre = map.T_scene_view * (candidate.T_view_model.cast<double>() * model.centre);
  const Matrix6d J = seen_from(hypothesis.T_scene_model.translation() - centre) * to_scene;
  hypothesis.covariance = J * uncertainty.covariance * J.transpose();
  for (const Twist& motion : uncertainty.free_directions) hypothesis.free_directions.emplace_back(J * motion);
}

}  // namespace

PoseHypothesis describe(const Candidate& candidate, const DepthMap& map, const Model& model,
                        const VerifyOptions& verification, const DetectParams& params) {
  PoseHypothesis hypothesis;
  hypothesis.model_index = candidate.model_index;
  hypothesis.T_scene_model = preferred(map.T_scene_view * Pose(candidate.T_view_model.cast<double>()), model.symmetry,
                                       candidate.model_index, params);
  if (params.list_equivalents) hypothesis.equivalents = equivalents_of(hypothesis.T_scene_model, model.symmetry);
  add_uncertainty(candidate, map, model, verification, hypothesis);
  hypothesis.score = candidate.score();
  hypothesis.visible_fraction = 1 - candidate.evidence.occluded;
  hypothesis.explained_fraction = candidate.evidence.explained;
  hypothesis.violated_fraction = candidate.evidence.violated;
  hypothesis.unexplained_fraction = candidate.evidence.unexplained;
  hypothesis.outline_confirmed = candidate.evidence.outline_confirmed;
  hypothesis.outline_contradicted = candidate.evidence.outline_contradicted;
  hypothesis.explained_area = candidate.evidence.area;
  hypothesis.confidence = candidate.confidence;
  for (const Eigen::Isometry3f& rival : candidate.rivals) {
    hypothesis.variants.push_back(map.T_scene_view * Pose(rival.cast<double>()));
  }
  hypothesis.residual = candidate.evidence.residual;
  hypothesis.votes = candidate.votes;
  hypothesis.occluded_by = candidate.occluded_by;
  return hypothesis;
}

}  // namespace binpose

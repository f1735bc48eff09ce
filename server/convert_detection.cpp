#include "server/convert_detection.h"

#include "absl/strings/str_format.h"
#include "server/convert_geometry.h"
#include "server/convert_search_space.h"

namespace binpose::server {
namespace {

using server::to_proto;

v1::StopReason to_proto(StopReason reason) {
  switch (reason) {
    case StopReason::kComplete:
      return v1::STOP_REASON_COMPLETE;
    case StopReason::kDeadline:
      return v1::STOP_REASON_DEADLINE;
    case StopReason::kMaxResults:
      return v1::STOP_REASON_MAX_RESULTS;
  }
  return v1::STOP_REASON_UNSPECIFIED;
}

v1::DetectStats to_proto(const DetectStats& stats) {
  v1::DetectStats message;
  message.set_total_seconds(stats.total_seconds);
  message.set_preprocess_seconds(stats.preprocess_seconds);
  message.set_vote_seconds(stats.vote_seconds);
  message.set_cluster_seconds(stats.cluster_seconds);
  message.set_refine_seconds(stats.refine_seconds);
  message.set_verify_seconds(stats.verify_seconds);
  message.set_rank_seconds(stats.rank_seconds);
  message.set_point_count(stats.point_count);
  message.set_start_point_count(stats.start_point_count);
  message.set_scene_pair_count(stats.scene_pair_count);
  message.set_vote_count(stats.vote_count);
  message.set_cluster_count(stats.cluster_count);
  message.set_verified_count(stats.verified_count);
  message.set_stop_reason(to_proto(stats.stop_reason));
  return message;
}

/// Of a motion of lengths in metres.
v1::Twist to_twist(const Twist& motion, double metres_per_unit) {
  v1::Twist message;
  *message.mutable_translation() = to_proto(Eigen::Vector3d(motion.head<3>() / metres_per_unit));
  *message.mutable_rotation() = to_proto(Eigen::Vector3d(motion.tail<3>()));
  return message;
}

void add_covariance(const Matrix6d& covariance, double metres_per_unit, v1::PoseHypothesis& message) {
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      const double unit = (row < 3 ? metres_per_unit : 1) * (column < 3 ? metres_per_unit : 1);
      message.add_covariance(covariance(row, column) / unit);
    }
  }
}

v1::PoseHypothesis to_proto(const PoseHypothesis& hypothesis, const std::string& model_id, double metres_per_unit) {
  v1::PoseHypothesis message;
  message.set_model_id(model_id);
  *message.mutable_pose() = to_proto(hypothesis.T_scene_model, metres_per_unit);
  message.set_score(hypothesis.score);
  message.set_visible_fraction(hypothesis.visible_fraction);
  message.set_explained_fraction(hypothesis.explained_fraction);
  message.set_violated_fraction(hypothesis.violated_fraction);
  message.set_unexplained_fraction(hypothesis.unexplained_fraction);
  message.set_explained_area(hypothesis.explained_area);
  message.set_confidence(hypothesis.confidence);
  for (const Pose& variant : hypothesis.variants) *message.add_variants() = to_proto(variant, metres_per_unit);
  for (const Pose& other : hypothesis.equivalents) *message.add_equivalents() = to_proto(other, metres_per_unit);
  add_covariance(hypothesis.covariance, metres_per_unit, message);
  for (const auto& motion : hypothesis.free_directions) {
    *message.add_free_directions() = to_twist(motion, metres_per_unit);
  }
  message.set_residual(hypothesis.residual / metres_per_unit);
  message.set_votes(hypothesis.votes);
  for (const int index : hypothesis.occluded_by) message.add_occluded_by(static_cast<std::uint32_t>(index));
  return message;
}

absl::StatusOr<DetectParams> params_of(v1::Effort effort) {
  switch (effort) {
    case v1::EFFORT_UNSPECIFIED:
    case v1::EFFORT_BALANCED:
      return DetectParams();
    case v1::EFFORT_FAST:
      return DetectParams::fast();
    case v1::EFFORT_THOROUGH:
      return DetectParams::thorough();
    default:
      return absl::InvalidArgumentError(absl::StrFormat(
          "effort is %d; it must be EFFORT_FAST (1), EFFORT_BALANCED (2) or EFFORT_THOROUGH (3).", effort));
  }
}

}  // namespace

absl::StatusOr<DetectParams> to_detect_params(const v1::DetectParams& message,
                                              const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                                              double metres_per_unit) {
  absl::StatusOr<DetectParams> base = params_of(message.effort());
  if (!base.ok()) return base.status();
  DetectParams params = *std::move(base);
  if (message.has_min_score()) params.min_score = message.min_score();
  if (message.has_presence_score()) params.presence_score = message.presence_score();
  if (message.has_max_results()) params.max_results = saturate(message.max_results());
  if (message.has_max_rejected()) params.max_rejected = saturate(message.max_rejected());
  if (message.has_start_point_share()) params.start_point_share = message.start_point_share();
  if (message.has_normal_tolerance_degrees()) params.normal_tolerance = message.normal_tolerance_degrees() * kDegree;
  if (message.has_remove_support_plane()) params.remove_support_plane = message.remove_support_plane();
  params.list_equivalents = message.list_equivalents();
  params.accept_ambiguous = message.accept_ambiguous();
  if (message.has_reference_orientation()) {
    const auto reference = to_rotation("reference_orientation", message.reference_orientation());
    if (!reference.ok()) return reference.status();
    params.reference_orientation = *reference;
  }
  absl::StatusOr<SearchSpace> space = to_search_space(message, model_ids, metres_per_unit);
  if (!space.ok()) return space.status();
  params.space = *std::move(space);
  if (absl::Status status = validate(params); !status.ok()) return status;
  return params;
}

v1::DetectResponse to_response(const DetectResult& result,
                               const google::protobuf::RepeatedPtrField<std::string>& model_ids,
                               double metres_per_unit) {
  v1::DetectResponse message;
  for (const PoseHypothesis& hypothesis : result.hypotheses) {
    *message.add_hypotheses() = to_proto(hypothesis, model_ids[hypothesis.model_index], metres_per_unit);
  }
  for (const PoseHypothesis& hypothesis : result.rejected) {
    *message.add_rejected() = to_proto(hypothesis, model_ids[hypothesis.model_index], metres_per_unit);
  }
  *message.mutable_stats() = to_proto(result.stats);
  for (const std::string& warning : result.warnings) message.add_warnings(warning);
  return message;
}

}  // namespace binpose::server

#include "server/convert_detection.h"

#include "server/convert_geometry.h"

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

v1::PoseHypothesis to_proto(const PoseHypothesis& hypothesis, const std::string& model_id, double metres_per_unit) {
  v1::PoseHypothesis message;
  message.set_model_id(model_id);
  *message.mutable_pose() = to_proto(hypothesis.T_scene_model, metres_per_unit);
  message.set_score(hypothesis.score);
  message.set_visible_fraction(hypothesis.visible_fraction);
  message.set_explained_fraction(hypothesis.explained_fraction);
  message.set_violated_fraction(hypothesis.violated_fraction);
  message.set_unexplained_fraction(hypothesis.unexplained_fraction);
  message.set_confidence(hypothesis.confidence);
  for (const Pose& variant : hypothesis.variants) *message.add_variants() = to_proto(variant, metres_per_unit);
  message.set_residual(hypothesis.residual / metres_per_unit);
  message.set_votes(hypothesis.votes);
  for (const int index : hypothesis.occluded_by) message.add_occluded_by(static_cast<std::uint32_t>(index));
  return message;
}

}  // namespace

absl::StatusOr<DetectParams> to_detect_params(const v1::DetectParams& message) {
  DetectParams params;
  if (message.has_min_score()) params.min_score = message.min_score();
  if (message.has_max_results()) params.max_results = saturate(message.max_results());
  if (message.has_max_rejected()) params.max_rejected = saturate(message.max_rejected());
  if (message.has_start_point_share()) params.start_point_share = message.start_point_share();
  if (message.has_normal_tolerance_degrees()) params.normal_tolerance = message.normal_tolerance_degrees() * kDegree;
  if (message.has_remove_support_plane()) params.remove_support_plane = message.remove_support_plane();
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

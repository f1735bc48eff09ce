#include "core/params.h"

#include <cmath>

#include "absl/strings/str_format.h"

namespace binpose {
namespace {

/// INVALID_ARGUMENT unless `value` is a number in [low, high].
absl::Status in_range(std::string_view field, double value, double low, double high) {
  if (value >= low && value <= high) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat("%s is %g; it must lie in [%g, %g].", field, value, low, high));
}

absl::Status first_error(std::initializer_list<absl::Status> statuses) {
  for (const absl::Status& status : statuses) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status validate_lengths(const TrainParams& params) {
  if (params.pair_lengths.empty() || params.pair_lengths.size() > 4) {
    return absl::InvalidArgumentError(
        absl::StrFormat("pair_lengths has %d entries; it must have 1 to 4.", params.pair_lengths.size()));
  }
  for (const PairLengths& lengths : params.pair_lengths) {
    absl::Status status = first_error({in_range("pair_lengths.relative_q1", lengths.relative_q1, 0.05, 0.9),
                                       in_range("pair_lengths.relative_q2", lengths.relative_q2, 0.05, 0.9)});
    if (!status.ok()) return status;
    // Otherwise Q1 and Q2 could swap roles, and a pair would have two features.
    const double gap = std::abs(lengths.relative_q1 - lengths.relative_q2);
    if (gap < 2 * params.relative_length_tolerance) {
      return absl::InvalidArgumentError(
          absl::StrFormat("pair_lengths.relative_q1 and relative_q2 are %g and %g; they must differ by at least %g.",
                          lengths.relative_q1, lengths.relative_q2, 2 * params.relative_length_tolerance));
    }
  }
  return absl::OkStatus();
}

absl::Status validate_reference(const DetectParams& params) {
  if (!params.reference_orientation || std::abs(params.reference_orientation->norm() - 1) <= 1e-6) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrFormat(
      "reference_orientation has length %g; it must be a unit quaternion.", params.reference_orientation->norm()));
}

}  // namespace

TrainParams TrainParams::paper() {
  TrainParams params;
  params.pair_lengths = {{0.30, 0.22}};
  params.selection = PairSelection::kIntegration;
  params.pairs_per_point = 0.1;
  return params;
}

DetectParams DetectParams::paper() {
  DetectParams params;
  params.normal_tolerance = 180 * kDegree;
  params.cluster_limit = 200;  // several for each of the twenty to thirty parts of a full bin
  params.use_contours = false;
  params.refine = false;
  params.verification = Verification::kAllPoints;
  params.min_score = 0;
  params.presence_score = 0;
  params.start_point_share = 1;
  return params;
}

DetectParams DetectParams::fast() {
  DetectParams params;
  params.start_point_share = 0.06;
  params.cluster_limit = 240;
  params.refine_limit = 80;
  params.refined_per_place = 2;
  params.finalist_limit = 50;
  params.finalists_per_place = 2;
  return params;
}

DetectParams DetectParams::thorough() {
  DetectParams params;
  params.start_point_share = 1;
  params.cluster_limit = 4000;
  params.least_promise = 0;
  params.refine_limit = 1200;
  params.refined_per_place = 24;
  params.finalist_limit = 500;
  params.finalists_per_place = 16;
  return params;
}

absl::Status validate(const TrainParams& params) {
  if (params.observability_weight == 0 && params.distinctiveness_weight == 0) {
    return absl::InvalidArgumentError("observability_weight and distinctiveness_weight are both 0; one must be above.");
  }
  return first_error({in_range("relative_sampling", params.relative_sampling, 0.02, 0.1),
                      in_range("relative_length_tolerance", params.relative_length_tolerance, 0.001, 0.05),
                      in_range("bin_width_degrees", params.bin_width / kDegree, 4, 45),
                      in_range("viewpoint_count", params.viewpoint_count, 16, 4096),
                      in_range("pairs_per_point", params.pairs_per_point, 0.001, 20),
                      in_range("observability_weight", params.observability_weight, 0, 1000),
                      in_range("distinctiveness_weight", params.distinctiveness_weight, 0, 1000),
                      validate_lengths(params)});
}

absl::Status validate(const DetectParams& params) {
  return first_error({
      in_range("min_score", params.min_score, 0, 1),
      in_range("presence_score", params.presence_score, 0, 1),
      in_range("max_results", params.max_results, 1, 1000),
      in_range("max_rejected", params.max_rejected, 0, 1000),
      in_range("cluster_limit", params.cluster_limit, 1, 100000),
      in_range("least_promise", params.least_promise, -2, 2),
      in_range("refine_limit", params.refine_limit, 1, 100000),
      in_range("refined_per_place", params.refined_per_place, 1, 1000),
      in_range("finalist_limit", params.finalist_limit, 1, 100000),
      in_range("finalists_per_place", params.finalists_per_place, 1, 1000),
      in_range("start_point_share", params.start_point_share, 0.001, 1),
      in_range("normal_tolerance_degrees", params.normal_tolerance / kDegree, 2, 180),
      validate_reference(params),
      validate(params.space),
  });
}

}  // namespace binpose

#include "core/params.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace binpose {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(Params, DefaultsAreValid) {
  EXPECT_TRUE(validate(TrainParams{}).ok());
  EXPECT_TRUE(validate(TrainParams::paper()).ok());
  EXPECT_TRUE(validate(DetectParams{}).ok());
}

TEST(Params, PaperPresetUsesOnePairOfLengthsAndOneToOneIntegration) {
  const TrainParams paper = TrainParams::paper();
  EXPECT_EQ(paper.pair_lengths.size(), 1u);
  EXPECT_EQ(paper.selection, PairSelection::kIntegration);
  EXPECT_EQ(paper.pairs_per_point, 0.1);
  EXPECT_EQ(paper.observability_weight, paper.distinctiveness_weight);
}

TEST(Params, RefusalNamesFieldValueAndRange) {
  DetectParams params;
  params.min_score = 1.5;
  const absl::Status status = validate(params);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("min_score"), HasSubstr("1.5"), HasSubstr("[0, 1]")));
}

TEST(Params, RefusesNotANumber) {
  TrainParams params;
  params.relative_sampling = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(validate(params).ok());
}

TEST(Params, RefusesBothWeightsZero) {
  TrainParams params;
  params.observability_weight = 0;
  params.distinctiveness_weight = 0;
  EXPECT_THAT(validate(params).message(),
              AllOf(HasSubstr("observability_weight"), HasSubstr("distinctiveness_weight")));
}

TEST(Params, RefusesPairLengthsThatCouldSwapRoles) {
  TrainParams params;
  params.pair_lengths = {{0.30, 0.29}};
  EXPECT_THAT(validate(params).message(), HasSubstr("must differ by at least 0.04"));
}

TEST(Params, RefusesNoneOrTooManyPairLengths) {
  TrainParams params;
  params.pair_lengths.clear();
  EXPECT_THAT(validate(params).message(), HasSubstr("has 0 entries"));
  params.pair_lengths.assign(5, PairLengths{});
  EXPECT_THAT(validate(params).message(), HasSubstr("has 5 entries"));
}

}  // namespace
}  // namespace binpose

#include "core/train/select.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/scenes/random.h"

namespace binpose {
namespace {

TEST(PairValue, OfEachSelectionByHand) {
  TrainParams params;
  params.observability_weight = 2;
  params.distinctiveness_weight = 3;
  params.selection = PairSelection::kDistinctiveness;
  EXPECT_DOUBLE_EQ(pair_value(0.3, 0.04, params), 0.96);
  params.selection = PairSelection::kObservability;
  EXPECT_DOUBLE_EQ(pair_value(0.3, 0.04, params), 0.3);
  params.selection = PairSelection::kIntegration;  // Eq. (7)
  EXPECT_DOUBLE_EQ(pair_value(0.3, 0.04, params), 2 * 0.3 + 3 * 0.96);
  params.selection = PairSelection::kSignalToNoise;
  EXPECT_DOUBLE_EQ(pair_value(0.3, 0.04, params), 0.3 / 0.2);
}

TEST(BestPairs, AreTheFirstOfAStableSort) {
  scenes::Random random(4);
  std::vector<double> values;
  constexpr std::size_t kCount = 150000;  // some blocks
  values.reserve(kCount);
  for (std::size_t i = 0; i < kCount; ++i) values.push_back(static_cast<double>(random.next() % 10000));  // many equal
  std::vector<std::size_t> sorted;
  for (std::size_t i = 0; i < values.size(); ++i) sorted.push_back(i);
  std::stable_sort(sorted.begin(), sorted.end(), [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{4000}, kCount}) {
    EXPECT_EQ(best_pairs(values, count),
              std::vector<std::size_t>(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(count)));
  }
}

TEST(BestPairs, AreAllWhenFewerThanWanted) {
  const std::vector<double> values = {1, 3, 2};
  EXPECT_EQ(best_pairs(values, 10), std::vector<std::size_t>({1, 2, 0}));
  EXPECT_TRUE(best_pairs({}, 10).empty());
}

}  // namespace
}  // namespace binpose

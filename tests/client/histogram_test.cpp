#include "client/cli/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace binpose::client::cli {
namespace {

TEST(Histogram, OfNothingSaysZero) {
  EXPECT_EQ(Histogram().count(), 0U);
  EXPECT_EQ(Histogram().quantile(0.99), 0);
}

TEST(Histogram, QuantilesAreThoseOfTheSortedListToOnePercent) {
  std::mt19937 random(1);
  std::lognormal_distribution<double> duration(-3, 2);  // from below a millisecond to minutes
  Histogram histogram;
  std::vector<double> all;
  for (int i = 0; i < 20000; ++i) {
    all.push_back(duration(random));
    histogram.record(all.back());
  }
  std::sort(all.begin(), all.end());
  for (const double quantile : {0.0001, 0.5, 0.9, 0.99, 0.9999}) {
    const double exact = all[static_cast<std::size_t>(std::ceil(quantile * 20000)) - 1];
    EXPECT_NEAR(histogram.quantile(quantile), exact, 0.01 * exact + 1e-6) << quantile;
  }
  EXPECT_EQ(histogram.quantile(1), all.back());
  EXPECT_EQ(histogram.max(), all.back());
}

TEST(Histogram, SumsAreThoseOfOneHistogram) {
  Histogram fast, slow, both;
  for (int i = 1; i <= 100; ++i) {
    fast.record(0.001 * i);
    slow.record(1.0 * i);
    both.record(0.001 * i);
    both.record(1.0 * i);
  }
  fast.add(slow);
  EXPECT_EQ(fast.count(), 200U);
  EXPECT_EQ(fast.quantile(0.5), both.quantile(0.5));
  EXPECT_EQ(fast.quantile(0.99), both.quantile(0.99));
}

TEST(Histogram, TakesWhateverItIsGiven) {
  Histogram histogram;
  for (const double seconds : {-1.0, 0.0, 1e-9, 1e7, 1e300}) histogram.record(seconds);
  EXPECT_EQ(histogram.count(), 5U);
  EXPECT_EQ(histogram.quantile(0.5), 0);
  EXPECT_GT(histogram.quantile(1), 3600);
}

}  // namespace
}  // namespace binpose::client::cli

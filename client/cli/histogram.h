#pragma once

#include <cstdint>
#include <vector>

namespace binpose::client::cli {

/// Durations in buckets that are exact to 1 %, from a microsecond to more than an hour; fixed memory, no samples kept
/// (the layout of HdrHistogram).
class Histogram {
 public:
  Histogram();

  /// Below a microsecond counts as nothing; beyond the last bucket counts into it.
  void record(double seconds);
  void add(const Histogram& other);

  std::uint64_t count() const { return count_; }
  /// The duration that the share `quantile` of all does not exceed, seconds; 0 when nothing was recorded.
  double quantile(double quantile) const;
  double max() const { return max_; }

 private:
  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
  double max_ = 0;
};

}  // namespace binpose::client::cli

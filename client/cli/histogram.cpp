#include "client/cli/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace binpose::client::cli {
namespace {

// Each power of two of microseconds is divided into kSteps equal buckets; below kSteps every microsecond has its own.
constexpr std::uint64_t kSteps = 128;
constexpr int kStepBits = 7;
constexpr int kOctaves = 25;  // to 2^(7 + 25) microseconds

std::size_t bucket_of(std::uint64_t microseconds) {
  if (microseconds < kSteps) return microseconds;
  const int octave = std::bit_width(microseconds) - 1 - kStepBits;
  return static_cast<std::size_t>(octave) * kSteps + (microseconds >> octave);
}

/// The largest value of a bucket, microseconds.
double top_of(std::size_t bucket) {
  if (bucket < kSteps) return static_cast<double>(bucket);
  const std::size_t octave = bucket / kSteps - 1;
  const std::size_t step = bucket % kSteps + kSteps;
  return static_cast<double>(((step + 1) << octave) - 1);
}

}  // namespace

Histogram::Histogram() : buckets_((kOctaves + 1) * kSteps, 0) {}

void Histogram::record(double seconds) {
  const double microseconds = std::clamp(seconds * 1e6, 0.0, 1e15);
  const std::size_t bucket = bucket_of(static_cast<std::uint64_t>(microseconds));
  ++buckets_[std::min(bucket, buckets_.size() - 1)];
  ++count_;
  max_ = std::max(max_, seconds);
}

void Histogram::add(const Histogram& other) {
  for (std::size_t i = 0; i < buckets_.size(); ++i) buckets_[i] += other.buckets_[i];
  count_ += other.count_;
  max_ = std::max(max_, other.max_);
}

double Histogram::quantile(double quantile) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(quantile * static_cast<double>(count_)));
  std::uint64_t passed = 0;
  for (std::size_t i = 0; i < buckets_.size(); ++i) {
    passed += buckets_[i];
    if (passed > 0 && passed >= wanted) return std::min(1e-6 * top_of(i), max_);
  }
  return 0;
}

}  // namespace binpose::client::cli

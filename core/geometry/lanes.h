#pragma once

#include <cmath>
#include <cstdint>

/// Compiles a function for today's processors as well as for the baseline; the program picks one when it starts.
/// Neither fuses multiplication with addition, so that both give the same bits. (Sanitizers can't start with such
/// functions, and clang, which builds the fuzz targets, does not take their calls.)
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BINPOSE_VECTORISED __attribute__((target_clones("avx2", "default")))
#else
#define BINPOSE_VECTORISED
#endif

namespace binpose {

/// Eight numbers that are computed with at once.
constexpr int kLanes = 8;
using Lanes = float __attribute__((vector_size(4 * kLanes)));
using LaneInts = std::int32_t __attribute__((vector_size(4 * kLanes)));  ///< masks as well: -1 = true

/// In one go: a copy by memcpy is split into what the baseline loads before the function meets a wider processor.
[[gnu::always_inline]] inline Lanes load_lanes(const float* values) {
  using Unaligned [[gnu::aligned(4), gnu::may_alias]] = Lanes;
  return *reinterpret_cast<const Unaligned*>(values);
}

[[gnu::always_inline]] inline void store_lanes(const Lanes& lanes, float* values) {
  using Unaligned [[gnu::aligned(4), gnu::may_alias]] = Lanes;
  *reinterpret_cast<Unaligned*>(values) = lanes;
}

[[gnu::always_inline]] inline Lanes magnitude(const Lanes& a) { return a < 0 ? -a : a; }

[[gnu::always_inline]] inline Lanes root(const Lanes& a) {
  Lanes result = {};
  for (int i = 0; i < kLanes; ++i) result[i] = std::sqrt(a[i]);
  return result;
}

[[gnu::always_inline]] inline int sum_of(const LaneInts& a) {
  int sum = 0;
  for (int i = 0; i < kLanes; ++i) sum += a[i];
  return sum;
}

/// Bit i is set where lane i of a mask is.
[[gnu::always_inline]] inline unsigned bits_of(const LaneInts& mask) {
  using Words = std::uint64_t __attribute__((vector_size(4 * kLanes)));
  const auto words = reinterpret_cast<Words>(mask & LaneInts{1, 2, 4, 8, 16, 32, 64, 128});
  const std::uint64_t bits = words[0] | words[1] | words[2] | words[3];
  return static_cast<unsigned>(bits | bits >> 32);
}

/// Calls `use(lane)` for each of the first `count` > 0 lanes that a mask has set.
template <typename Use>
[[gnu::always_inline]] inline void for_each_set(const LaneInts& mask, int count, Use&& use) {
  const unsigned asked = (1U << (count < kLanes ? count : kLanes)) - 1;
  for (unsigned bits = bits_of(mask) & asked; bits != 0; bits &= bits - 1) use(__builtin_ctz(bits));
}

/// In a fixed order, whatever the processor.
[[gnu::always_inline]] inline float sum_of(const Lanes& a) {
  return ((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7]));
}

}  // namespace binpose

#include "core/pair_table.h"

#include <cmath>

#include "core/slots.h"

namespace binpose {
namespace {

/// First and last bin that the angles within `margin` of a cosine's fall into.
std::pair<int, int> bins_within(const FeatureBins& bins, float cosine, double margin) {
  const double angle = std::acos(std::clamp(static_cast<double>(cosine), -1.0, 1.0));
  const auto low = static_cast<float>(std::cos(std::max(0.0, angle - margin)));
  const auto high = static_cast<float>(std::cos(std::min(3.14159265358979, angle + margin)));
  return {bins.axis_bin(low), bins.axis_bin(high)};
}

}  // namespace

PairTable::PairTable(std::span<const SurfacePoint> points, std::span<const VectorPair> pairs,
                     std::span<const float> weights, const Eigen::Vector3f& centre, int scale_count, double bin_width,
                     double margin, const RunControl& control)
    : bins_(bin_width) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> placed;  // slot and pair
  std::vector<PairNormals> normals(pairs.size());
  votes_.reserve(pairs.size());
  for (std::uint32_t i = 0; i < pairs.size() && !control.interrupted_at(i); ++i) {
    const SurfacePoint &p = points[pairs[i].p], &q1 = points[pairs[i].q1], &q2 = points[pairs[i].q2];
    const Eigen::Matrix3f frame = pair_frame(p.position, q1.position, q2.position);
    normals[i] = pair_normals(frame, p, q1, q2);
    votes_.push_back({Eigen::Quaternionf(Eigen::Matrix3f(frame.transpose())), frame.transpose() * (centre - p.position),
                      weights[i]});
    const auto [p_low, p_high] = bins_within(bins_, normals[i](2, 0), margin);
    const auto [q1_low, q1_high] = bins_within(bins_, normals[i](2, 1), margin);
    const auto [q2_low, q2_high] = bins_within(bins_, normals[i](2, 2), margin);
    for (int a = p_low; a <= p_high; ++a) {
      for (int b = q1_low; b <= q1_high; ++b) {
        for (int c = q2_low; c <= q2_high; ++c) {
          const int bin = (a * bins_.per_axis() + b) * bins_.per_axis() + c;
          placed.emplace_back(pairs[i].scale * bins_.count() + bin, i);
        }
      }
    }
  }

  const Slots<std::uint32_t> slots =
      by_slot<std::uint32_t>(placed, static_cast<std::size_t>(scale_count) * bins_.count());
  first_block_.push_back(0);
  for (std::size_t s = 0; s + 1 < slots.first.size() && !control.interrupted_at(s); ++s) {
    for (std::uint32_t start = slots.first[s]; start < slots.first[s + 1]; start += kBlock) {
      Block block = {};
      for (int lane = 0; lane < kBlock; ++lane) {
        const bool used = start + lane < slots.first[s + 1];
        block.pair[lane] = used ? slots.items[start + lane] : kNoPair;
        for (int c = 0; c < 9 && used; ++c) {
          block.normals[c][lane] =
              static_cast<std::int16_t>(std::lround(kUnit * normals[block.pair[lane]](c % 3, c / 3)));
        }
      }
      blocks_.push_back(block);
    }
    first_block_.push_back(static_cast<std::uint32_t>(blocks_.size()));
  }
}

}  // namespace binpose

#include "core/contour_pair.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace binpose {
namespace {

constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;

bool makes_pair(const ContourPoint& a, const ContourPoint& b, float shortest, float longest, float flatness) {
  const Eigen::Vector3f line = b.position - a.position;
  const float sq_distance = line.squaredNorm();
  return sq_distance >= shortest * shortest && sq_distance <= longest * longest &&
         a.normal.dot(b.normal) >= kSameNormalCosine && std::abs(a.normal.dot(line)) <= flatness &&
         std::abs(b.normal.dot(line)) <= flatness;
}

}  // namespace

std::optional<ContourFrame> contour_frame(const ContourPoint& a, const ContourPoint& b, float shortest, float longest,
                                          float flatness) {
  const Eigen::Vector3f line = b.position - a.position;
  const float distance = line.norm();
  if (!makes_pair(a, b, shortest, longest, flatness) || !(distance > 0)) return std::nullopt;
  Eigen::Matrix3f axes;
  axes.col(0) = line / distance;
  const Eigen::Vector3f normal = a.normal + b.normal;
  axes.col(2) = (normal - axes.col(0) * axes.col(0).dot(normal)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  ContourFrame frame;
  frame.T_outer_pair.linear() = axes;
  frame.T_outer_pair.translation() = a.position;
  frame.T_outer_pair.makeAffine();
  frame.feature = {distance, std::atan2(axes.col(1).dot(a.outward), axes.col(0).dot(a.outward)),
                   std::atan2(axes.col(1).dot(b.outward), axes.col(0).dot(b.outward))};
  return frame;
}

int ContourTable::distance_bin(float distance) const {
  const float share = (distance / diameter_ - kShortestContourPair) / (kLongestContourPair - kShortestContourPair);
  return std::clamp(static_cast<int>(share * kDistanceBins), 0, kDistanceBins - 1);
}

int ContourTable::angle_bin(float angle) {
  const int bin = static_cast<int>(std::floor((angle + kTwoPi) / kTwoPi * kAngleBins));
  return bin % kAngleBins;
}

ContourTable::ContourTable(std::span<const ContourPoint> points, std::span<const ContourPair> pairs,
                           std::span<const float> weights, const Eigen::Vector3f& centre, float diameter,
                           const RunControl& control)
    : diameter_(diameter), distance_tolerance_(kRelativeDistanceTolerance * diameter) {
  std::vector<ContourFeature> features;
  for (std::size_t i = 0; i < pairs.size() && !control.interrupted_at(i); ++i) {
    for (const auto& [a, b] : {std::pair(pairs[i].a, pairs[i].b), std::pair(pairs[i].b, pairs[i].a)}) {
      const std::optional<ContourFrame> frame = contour_frame(points[a], points[b], 0, 2 * diameter, diameter);
      if (!frame) continue;
      const Eigen::Isometry3f T_pair_model = frame->T_outer_pair.inverse();
      features.push_back(frame->feature);
      votes_.push_back({T_pair_model * centre, weights[i], Eigen::Quaternionf(T_pair_model.linear())});
    }
  }
  std::vector<std::pair<std::uint32_t, Entry>> placed;
  for (std::uint32_t i = 0; i < features.size() && !control.interrupted_at(i); ++i) {
    const ContourFeature& f = features[i];
    const int low = distance_bin(f.distance - distance_tolerance_),
              high = distance_bin(f.distance + distance_tolerance_);
    // The angles' tolerance is a bin's width: the neighbours on either side hold all that may match.
    for (int d = low; d <= high; ++d) {
      for (int a = -1; a <= 1; ++a) {
        for (int b = -1; b <= 1; ++b) {
          placed.emplace_back(slot_of(d, (angle_bin(f.angle_a) + a + kAngleBins) % kAngleBins,
                                      (angle_bin(f.angle_b) + b + kAngleBins) % kAngleBins),
                              Entry{f, i});
        }
      }
    }
  }
  slots_ = by_slot<Entry>(placed, slot_of(kDistanceBins - 1, kAngleBins - 1, kAngleBins - 1) + 1);
}

}  // namespace binpose

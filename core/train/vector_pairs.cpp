#include "core/train/vector_pairs.h"

#include <cmath>

namespace binpose {
namespace {

struct EndPoint {
  std::uint16_t index;
  Eigen::Vector3f direction;  // unit vector from P
};

/// Points at `length` +- `tolerance` from point p.
std::vector<EndPoint> shell(std::span<const SurfacePoint> points, std::size_t p, double length, double tolerance) {
  std::vector<EndPoint> found;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f d = points[i].position - points[p].position;
    const float distance = d.norm();
    if (std::abs(distance - length) <= tolerance) found.push_back({static_cast<std::uint16_t>(i), d / distance});
  }
  return found;
}

}  // namespace

std::vector<VectorPair> vector_pairs(std::span<const SurfacePoint> points, const PairLengths& lengths,
                                     double relative_tolerance, double diameter, int scale, const RunControl& control) {
  std::vector<VectorPair> pairs;
  const double tolerance = relative_tolerance * diameter;
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (control.interrupted()) return {};
    const std::vector<EndPoint> q1s = shell(points, p, lengths.relative_q1 * diameter, tolerance);
    const std::vector<EndPoint> q2s = shell(points, p, lengths.relative_q2 * diameter, tolerance);
    for (const EndPoint& q1 : q1s) {
      for (const EndPoint& q2 : q2s) {
        if (std::abs(q1.direction.dot(q2.direction)) > kRightAngleCosine) continue;
        pairs.push_back({static_cast<std::uint16_t>(p), q1.index, q2.index, static_cast<std::uint16_t>(scale)});
      }
    }
  }
  return pairs;
}

std::vector<double> occurrence_probability(std::span<const SurfacePoint> points, std::span<const VectorPair> pairs,
                                           const FeatureBins& bins, const RunControl& control,
                                           std::span<const double> weights) {
  std::vector<int> bin_of_pair(pairs.size());
  std::vector<double> histogram(bins.count(), 0);  // h of Eq. (2) and (3)
  double total = 0;
  for (std::size_t i = 0; i < pairs.size() && !control.interrupted_at(i); ++i) {
    const SurfacePoint &p = points[pairs[i].p], &q1 = points[pairs[i].q1], &q2 = points[pairs[i].q2];
    bin_of_pair[i] = bins.bin(pair_normals(pair_frame(p.position, q1.position, q2.position), p, q1, q2));
    const double weight = weights.empty() ? 1 : weights[i];
    histogram[bin_of_pair[i]] += weight;
    total += weight;
  }
  std::vector<double> probability(pairs.size());
  for (std::size_t i = 0; i < pairs.size() && !control.interrupted_at(i); ++i) {
    probability[i] = histogram[bin_of_pair[i]] / total;  // Eq. (4)
  }
  return probability;
}

}  // namespace binpose

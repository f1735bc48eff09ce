#include "core/train/contour_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <tuple>

namespace binpose {
namespace {

constexpr double kFewestViews = 0.02;
constexpr std::size_t kMostContours = 3000;
constexpr int kMostPairsPerPoint = 40;  // toothed parts would spend them all on a few teeth

using Bucket = std::tuple<int, int, int, int, int, int, int, int, int>;

Bucket bucket_of(const ContourPoint& c, double size) {
  const auto bin = [](double value, double width) { return static_cast<int>(std::floor(value / width + 0.5)); };
  const Eigen::Vector3f &p = c.position, &n = c.normal, &o = c.outward;
  return {bin(p.x(), size), bin(p.y(), size), bin(p.z(), size), bin(n.x(), 0.45), bin(n.y(), 0.45),
          bin(n.z(), 0.45), bin(o.x(), 0.45), bin(o.y(), 0.45), bin(o.z(), 0.45)};
}

struct Sum {
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero(),
                  outward = Eigen::Vector3d::Zero();
  int count = 0;
  ViewMask views;
};

int view_count_of(const ViewMask& mask) {
  int count = 0;
  for (const std::uint64_t word : mask) count += std::popcount(word);
  return count;
}

/// Feature bin for the occurrence probability, as coarse as the look-up's tolerances.
std::tuple<int, int, int> histogram_bin(const ContourFeature& f, double diameter) {
  constexpr double kAngle = 0.26;
  return {static_cast<int>(f.distance / (0.03 * diameter)), static_cast<int>(std::floor(f.angle_a / kAngle)),
          static_cast<int>(std::floor(f.angle_b / kAngle))};
}

}  // namespace

std::vector<PooledContour> pool_contours(std::span<const std::vector<ContourPoint>> views, double cell,
                                         const RunControl& control) {
  std::map<Bucket, Sum> sums;
  const std::size_t words = (views.size() + 63) / 64;
  for (std::size_t k = 0; k < views.size() && !control.interrupted(); ++k) {
    for (ContourPoint c : views[k]) {
      const Eigen::Vector3f in_plane = c.outward - c.normal * c.normal.dot(c.outward);
      if (in_plane.norm() < 0.5F) continue;  // the side of a rounded surface
      c.outward = in_plane.normalized();
      Sum& sum = sums[bucket_of(c, cell)];
      sum.views.resize(words, 0);
      sum.views[k / 64] |= std::uint64_t{1} << (k % 64);
      sum.position += c.position.cast<double>();
      sum.normal += c.normal.cast<double>();
      sum.outward += c.outward.cast<double>();
      ++sum.count;
    }
  }
  std::vector<PooledContour> pooled;
  for (auto& [key, sum] : sums) {
    if (view_count_of(sum.views) < kFewestViews * static_cast<double>(views.size())) continue;
    pooled.push_back({{(sum.position / sum.count).cast<float>(), sum.normal.normalized().cast<float>(),
                       sum.outward.normalized().cast<float>()},
                      std::move(sum.views)});
  }
  std::stable_sort(pooled.begin(), pooled.end(), [](const PooledContour& a, const PooledContour& b) {
    return view_count_of(a.views) > view_count_of(b.views);
  });
  if (pooled.size() > kMostContours) pooled.resize(kMostContours);
  return pooled;
}

RatedContourPairs select_contour_pairs(std::span<const PooledContour> contours, double diameter, std::size_t count,
                                       int view_count, const RunControl& control) {
  std::vector<ContourPair> pairs;
  std::vector<std::tuple<int, int, int>> bins;
  std::map<std::tuple<int, int, int>, int> histogram;
  const auto d = static_cast<float>(diameter);
  for (std::size_t a = 0; a < contours.size() && !control.interrupted(); ++a) {
    for (std::size_t b = a + 1; b < contours.size(); ++b) {
      const std::optional<ContourFrame> frame =
          contour_frame(contours[a].point, contours[b].point, kShortestContourPair * d, kLongestContourPair * d,
                        kContourFlatness * d);
      if (!frame) continue;
      pairs.push_back({static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b)});
      bins.push_back(histogram_bin(frame->feature, diameter));
      ++histogram[bins.back()];
    }
  }
  std::vector<double> values(pairs.size());
  for (std::size_t i = 0; i < pairs.size() && !control.interrupted_at(i); ++i) {
    int seen = 0;
    for (std::size_t w = 0; w < contours[pairs[i].a].views.size(); ++w) {
      seen += std::popcount(contours[pairs[i].a].views[w] & contours[pairs[i].b].views[w]);
    }
    values[i] = static_cast<double>(seen) / view_count / std::sqrt(static_cast<double>(histogram[bins[i]]));
  }
  RatedContourPairs rated;
  std::vector<int> used(contours.size(), 0);
  // A heap gives the best one after the other, as most are never asked for; of equal ones the first.
  std::vector<std::size_t> heap;
  const auto worse = [&](std::size_t a, std::size_t b) {
    return values[a] != values[b] ? values[a] < values[b] : a > b;
  };
  for (std::size_t i = 0; i < values.size() && !control.interrupted_at(i); ++i) {
    heap.push_back(i);
    std::push_heap(heap.begin(), heap.end(), worse);
  }
  while (!heap.empty() && rated.pairs.size() < count && !control.interrupted()) {
    std::pop_heap(heap.begin(), heap.end(), worse);
    const std::size_t i = heap.back();
    heap.pop_back();
    if (values[i] <= 0) break;
    if (std::max(used[pairs[i].a], used[pairs[i].b]) >= kMostPairsPerPoint) continue;
    ++used[pairs[i].a];
    ++used[pairs[i].b];
    rated.pairs.push_back(pairs[i]);
    rated.weights.push_back(static_cast<float>(1 / std::sqrt(static_cast<double>(histogram[bins[i]]))));
  }
  return rated;
}

}  // namespace binpose

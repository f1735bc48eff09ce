#include "tests/bench/paper/local_features.h"

#include <pcl/features/fpfh.h>
#include <pcl/features/shot.h>

#include <algorithm>
#include <cmath>

namespace binpose::paper {
namespace {

/// The finite rows of PCL's descriptors, `numbers` giving the array in each.
template <typename Descriptor, typename Numbers>
LocalFeatures to_features(const Cloud& keypoints, const pcl::PointCloud<Descriptor>& all, Numbers numbers) {
  using Row = Eigen::Map<const Eigen::RowVectorXf>;
  LocalFeatures features;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto& array = numbers(all[i]);
    const Row row(array, std::size(array));
    if (!row.allFinite() || row.isZero()) continue;
    features.points->push_back(keypoints[i]);
    rows.push_back(row);
  }
  features.descriptors.resize(static_cast<Eigen::Index>(rows.size()), rows.empty() ? 0 : rows[0].size());
  for (std::size_t i = 0; i < rows.size(); ++i) features.descriptors.row(static_cast<Eigen::Index>(i)) = rows[i];
  return features;
}

}  // namespace

LocalFeatures shot_features(const Cloud::Ptr& surface, const Cloud::Ptr& keypoints, double radius) {
  pcl::SHOTEstimation<pcl::PointNormal, pcl::PointNormal, pcl::SHOT352> estimation;
  estimation.setInputCloud(keypoints);
  estimation.setSearchSurface(surface);
  estimation.setInputNormals(surface);
  estimation.setRadiusSearch(radius);
  pcl::PointCloud<pcl::SHOT352> all;
  estimation.compute(all);
  return to_features(
      *keypoints, all, [](const pcl::SHOT352& d) -> const auto& { return d.descriptor; });
}

LocalFeatures fpfh_features(const Cloud::Ptr& surface, const Cloud::Ptr& keypoints, double radius) {
  pcl::FPFHEstimation<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> estimation;
  estimation.setInputCloud(keypoints);
  estimation.setSearchSurface(surface);
  estimation.setInputNormals(surface);
  estimation.setRadiusSearch(radius);
  pcl::PointCloud<pcl::FPFHSignature33> all;
  estimation.compute(all);
  return to_features(
      *keypoints, all, [](const pcl::FPFHSignature33& d) -> const auto& { return d.histogram; });
}

void append(LocalFeatures& features, const LocalFeatures& more) {
  *features.points += *more.points;
  const Eigen::Index before = features.descriptors.rows();
  features.descriptors.conservativeResize(before + more.descriptors.rows(), more.descriptors.cols());
  features.descriptors.bottomRows(more.descriptors.rows()) = more.descriptors;
}

std::vector<Nearest> nearest_features(const LocalFeatures& of, const LocalFeatures& among) {
  constexpr Eigen::Index kBlock = 256;  // rows whose products are held at once
  const Eigen::RowVectorXf squares = among.descriptors.rowwise().squaredNorm().transpose();
  std::vector<Nearest> nearest;
  for (Eigen::Index first = 0; first < of.descriptors.rows(); first += kBlock) {
    const auto block = of.descriptors.middleRows(first, std::min(kBlock, of.descriptors.rows() - first));
    // |a - b|^2 = |a|^2 + |b|^2 - 2 a b
    const Eigen::MatrixXf distances = (-2 * block * among.descriptors.transpose()).rowwise() + squares;
    for (Eigen::Index i = 0; i < block.rows(); ++i) {
      int best = 0;
      const float least = distances.row(i).minCoeff(&best);
      nearest.push_back({best, std::max(0.0F, least + block.row(i).squaredNorm())});
    }
  }
  return nearest;
}

}  // namespace binpose::paper

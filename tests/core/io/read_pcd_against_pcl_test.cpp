#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>

#include "core/io/read_pcd.h"

namespace binpose {
namespace {

/// An organised cloud with colour and normals, a hole in it, seen from somewhere.
pcl::PointCloud<pcl::PointXYZRGBNormal> make_cloud() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> coordinate(-500, 500);
  pcl::PointCloud<pcl::PointXYZRGBNormal> cloud(40, 30);
  for (auto& point : cloud) {
    point.getVector3fMap() = Eigen::Vector3f(coordinate(random), coordinate(random), coordinate(random));
    point.getNormalVector3fMap() =
        Eigen::Vector3f(coordinate(random), coordinate(random), coordinate(random)).normalized();
    point.r = static_cast<std::uint8_t>(random());
  }
  cloud[7].x = cloud[7].y = cloud[7].z = std::numeric_limits<float>::quiet_NaN();
  cloud.sensor_origin_ = Eigen::Vector4f(1, 2, 3, 0);
  return cloud;
}

class PclEncoding : public ::testing::TestWithParam<std::string> {
 protected:
  /// The cloud as PCL's own writer stores it.
  static std::string written_by_pcl(const pcl::PointCloud<pcl::PointXYZRGBNormal>& cloud) {
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("binpose_pcl_" + GetParam() + std::to_string(getpid()) + ".pcd");
    pcl::PCDWriter writer;
    if (GetParam() == "ascii") writer.writeASCII(path.string(), cloud, 9);
    if (GetParam() == "binary") writer.writeBinary(path.string(), cloud);
    if (GetParam() == "binary_compressed") writer.writeBinaryCompressed(path.string(), cloud);
    std::ostringstream bytes;
    bytes << std::ifstream(path, std::ios::binary).rdbuf();
    std::filesystem::remove(path);
    return bytes.str();
  }
};

TEST_P(PclEncoding, IsReadAsPclWroteIt) {
  const pcl::PointCloud<pcl::PointXYZRGBNormal> expected = make_cloud();
  const absl::StatusOr<PointCloud> cloud = read_pcd(written_by_pcl(expected), 1.0, 10'000);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->width, expected.width);
  EXPECT_EQ(cloud->height, expected.height);
  EXPECT_EQ(cloud->sensor_position, Eigen::Vector3d(1, 2, 3));
  ASSERT_EQ(cloud->points.size(), expected.size());
  ASSERT_EQ(cloud->normals.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (i == 7) {
      EXPECT_TRUE(cloud->points[i].array().isNaN().all());
      continue;
    }
    EXPECT_EQ(cloud->points[i], expected[i].getVector3fMap());
    EXPECT_TRUE(cloud->normals[i].isApprox(expected[i].getNormalVector3fMap(), 1e-5f));
  }
}

INSTANTIATE_TEST_SUITE_P(ReadPcd, PclEncoding, ::testing::Values("ascii", "binary", "binary_compressed"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace binpose

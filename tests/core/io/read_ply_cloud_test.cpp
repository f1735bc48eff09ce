#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "core/io/read_ply.h"

namespace binpose {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t kMaxPlyPoints = 100;

constexpr std::string_view kHeader =
    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

TEST(ReadPlyCloud, ReadsPointsInMetres) {
  const absl::StatusOr<PointCloud> cloud =
      read_ply_cloud(std::string(kHeader) + "end_header\n1 2 3\n4 nan 6\n", 0.001, kMaxPlyPoints);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_EQ(cloud->points.size(), 2u);
  EXPECT_EQ(cloud->width, 2u);
  EXPECT_EQ(cloud->height, 1u);
  EXPECT_TRUE(cloud->points[0].isApprox(Eigen::Vector3f(0.001f, 0.002f, 0.003f)));
  EXPECT_TRUE(std::isnan(cloud->points[1].y()));
  EXPECT_TRUE(cloud->normals.empty());
}

TEST(ReadPlyCloud, ReadsBinaryDoublesBehindOtherColumns) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar red\nproperty double x\n"
      "property double y\nproperty double z\nend_header\n\x7f";
  for (const double coordinate : {1.5, -2.5, 3.5}) {
    std::array<char, sizeof(coordinate)> raw{};
    std::memcpy(raw.data(), &coordinate, raw.size());
    bytes.append(raw.data(), raw.size());
  }
  const absl::StatusOr<PointCloud> cloud = read_ply_cloud(bytes, 1, kMaxPlyPoints);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->points[0], Eigen::Vector3f(1.5f, -2.5f, 3.5f));
}

TEST(ReadPlyCloud, MakesNormalsUnitVectors) {
  const absl::StatusOr<PointCloud> cloud =
      read_ply_cloud(std::string(kHeader) +
                         "property float nx\nproperty float ny\nproperty float nz\nend_header\n"
                         "1 2 3 0 0 -2\nnan nan nan 0 0 0\n",
                     1, kMaxPlyPoints);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_EQ(cloud->normals.size(), 2u);
  EXPECT_EQ(cloud->normals[0], Eigen::Vector3f(0, 0, -1));
}

TEST(ReadPlyCloud, DropsTheNormalsWhenAMeasuredPointHasNone) {
  const absl::StatusOr<PointCloud> cloud =
      read_ply_cloud(std::string(kHeader) +
                         "property float nx\nproperty float ny\nproperty float nz\nend_header\n"
                         "1 2 3 0 0 -1\n1 2 3 0 0 0\n",
                     1, kMaxPlyPoints);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_TRUE(cloud->normals.empty());
}

TEST(ReadPlyCloud, RefusesMorePointsThanTheLimit) {
  const absl::StatusOr<PointCloud> cloud = read_ply_cloud(std::string(kHeader) + "end_header\n1 2 3\n4 5 6\n", 1, 1);
  EXPECT_EQ(cloud.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(cloud.status().message()), AllOf(HasSubstr("2 vertices"), HasSubstr("1")));
}

TEST(ReadPlyCloud, RefusesWhatIsTruncatedOrLacksAColumn) {
  const auto refusal = [](const std::string& bytes) {
    const absl::StatusOr<PointCloud> cloud = read_ply_cloud(bytes, 1, kMaxPlyPoints);
    EXPECT_EQ(cloud.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(cloud.status().message());
  };
  EXPECT_THAT(refusal(std::string(kHeader) + "end_header\n1 2 3\n4 5\n"), HasSubstr("truncated"));
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
              HasSubstr("x, y, z"));
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nend_header\n"), HasSubstr("vertex"));
  EXPECT_THAT(refusal("no ply"), HasSubstr("ply"));
}

}  // namespace
}  // namespace binpose

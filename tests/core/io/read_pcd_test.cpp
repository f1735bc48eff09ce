#include "core/io/read_pcd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <liblzf/lzf.h>

#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace binpose {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::size_t kMaxPcdPoints = 1000;

std::string header(int width, int height, const std::string& encoding) {
  return absl::StrCat("# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 4 4\nTYPE U F F F\nCOUNT 1 1 1 1\nWIDTH ",
                      width, "\nHEIGHT ", height, "\nVIEWPOINT 100 -200 300 1 0 0 0\nPOINTS ", width * height,
                      "\nDATA ", encoding, "\n");
}

void append_float(float number, std::string& bytes) {
  std::array<char, sizeof(number)> raw{};
  std::memcpy(raw.data(), &number, raw.size());
  bytes.append(raw.data(), raw.size());
}

std::string ascii_pcd() { return header(2, 1, "ascii") + "4278190080 1 2 3\n0 nan nan nan\n"; }

std::string binary_pcd() {
  std::string bytes = header(2, 1, "binary");
  for (const float number : {0.f, 1.f, 2.f, 3.f, 0.f, NAN, NAN, NAN}) append_float(number, bytes);
  return bytes;
}

/// Field after field: all rgb, all x, all y, all z.
std::string compressed_pcd() {
  std::string plain;
  for (const float number : {0.f, 0.f, 1.f, NAN, 2.f, NAN, 3.f, NAN}) append_float(number, plain);
  std::vector<char> packed(plain.size() + 64);
  const std::array<std::uint32_t, 2> sizes = {lzf_compress(plain.data(), static_cast<unsigned>(plain.size()),
                                                           packed.data(), static_cast<unsigned>(packed.size())),
                                              static_cast<std::uint32_t>(plain.size())};
  std::string bytes = header(2, 1, "binary_compressed");
  bytes.append(reinterpret_cast<const char*>(sizes.data()), sizeof(sizes));
  return bytes.append(packed.data(), sizes[0]);
}

std::string pcd_refusal(const std::string& bytes, absl::StatusCode code = absl::StatusCode::kInvalidArgument) {
  const absl::StatusOr<PointCloud> cloud = read_pcd(bytes, 1, kMaxPcdPoints);
  EXPECT_EQ(cloud.status().code(), code);
  return std::string(cloud.status().message());
}

std::string with(const std::string& from, const std::string& to) {
  return absl::StrReplaceAll(ascii_pcd(), {{from, to}});
}

class EveryPcdEncoding : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryPcdEncoding, GivesTheSamePointsInMetres) {
  const absl::StatusOr<PointCloud> cloud = read_pcd(GetParam(), 0.001, kMaxPcdPoints);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  ASSERT_EQ(cloud->points.size(), 2u);
  EXPECT_TRUE(cloud->points[0].isApprox(Eigen::Vector3f(0.001f, 0.002f, 0.003f)));
  EXPECT_TRUE(cloud->points[1].array().isNaN().all());
  EXPECT_TRUE(cloud->sensor_position.isApprox(Eigen::Vector3d(0.1, -0.2, 0.3)));
  EXPECT_TRUE(cloud->normals.empty());
}

TEST_P(EveryPcdEncoding, IsRefusedWhenTruncated) {
  const std::string& bytes = GetParam();
  EXPECT_THAT(pcd_refusal(bytes.substr(0, bytes.size() - 5)), HasSubstr("truncated"));
  EXPECT_THAT(pcd_refusal(bytes.substr(0, bytes.find("DATA"))), HasSubstr("DATA"));
}

TEST_P(EveryPcdEncoding, NeverCrashesWhenDamaged) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 5000; ++trial) {
    std::string bytes = GetParam();
    for (unsigned change = 0; change < 1 + random() % 4; ++change) {
      const std::size_t place = random() % bytes.size();
      if (random() % 3 == 0) {
        bytes.insert(place, 1, "0123456789 \n"[random() % 12]);
      } else {
        bytes[place] = static_cast<char>(random());
      }
    }
    const absl::StatusOr<PointCloud> cloud = read_pcd(bytes, 1, kMaxPcdPoints);
    if (cloud.ok()) {
      ASSERT_EQ(cloud->points.size(), std::size_t{cloud->width} * cloud->height);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(ReadPcd, EveryPcdEncoding, ::testing::Values(ascii_pcd(), binary_pcd(), compressed_pcd()));

TEST(ReadPcd, ReadsVersion06WithoutCountAndViewpoint) {
  const absl::StatusOr<PointCloud> cloud = read_pcd(
      "VERSION .6\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1 2 3\n", 1, kMaxPcdPoints);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud->sensor_position, Eigen::Vector3d::Zero());
}

TEST(ReadPcd, RefusesNothingAndForeignBytes) {
  EXPECT_THAT(pcd_refusal(""), HasSubstr("DATA"));
  EXPECT_THAT(pcd_refusal("ply\nformat ascii 1.0\n"), HasSubstr("no PCD file"));
}

TEST(ReadPcd, RefusesAnEmptyCloud) {
  EXPECT_THAT(pcd_refusal(with("WIDTH 2", "WIDTH 0").replace(0, 0, "")),
              AllOf(HasSubstr("POINTS"), HasSubstr("0 x 1")));
  EXPECT_THAT(pcd_refusal(header(0, 1, "ascii")), HasSubstr("0 points"));
}

TEST(ReadPcd, RefusesPointsThatContradictWidthAndHeight) {
  EXPECT_THAT(pcd_refusal(with("POINTS 2", "POINTS 7")),
              AllOf(HasSubstr("POINTS"), HasSubstr("7"), HasSubstr("2 x 1")));
}

TEST(ReadPcd, RefusesMorePointsThanTheLimit) {
  EXPECT_THAT(pcd_refusal(header(100, 11, "binary"), absl::StatusCode::kResourceExhausted),
              AllOf(HasSubstr("1100 points"), HasSubstr("1000")));
}

TEST(ReadPcd, RefusesMissingAndMistypedFields) {
  EXPECT_THAT(pcd_refusal(with("rgb x y z", "rgb x y w")), HasSubstr("x, y, z"));
  EXPECT_THAT(pcd_refusal(with("TYPE U F F F", "TYPE U F F I")), AllOf(HasSubstr("field z"), HasSubstr("\"I\"")));
  EXPECT_THAT(pcd_refusal(with("SIZE 4 4 4 4", "SIZE 4 4 4 2")), AllOf(HasSubstr("field z"), HasSubstr("SIZE 2")));
  EXPECT_THAT(pcd_refusal(with("COUNT 1 1 1 1", "COUNT 1 1 1 3")), AllOf(HasSubstr("field z"), HasSubstr("COUNT 3")));
}

TEST(ReadPcd, RefusesAHeaderThatContradictsItself) {
  EXPECT_THAT(pcd_refusal(with("SIZE 4 4 4 4", "SIZE 4 4 4")),
              AllOf(HasSubstr("SIZE"), HasSubstr("3"), HasSubstr("4")));
  EXPECT_THAT(pcd_refusal(with("TYPE U F F F", "TYPE F")), HasSubstr("TYPE"));
  EXPECT_THAT(pcd_refusal(with("HEIGHT 1", "WIDTH 1")), AllOf(HasSubstr("WIDTH"), HasSubstr("twice")));
  EXPECT_THAT(pcd_refusal(with("WIDTH 2", "WIDTH -2")), AllOf(HasSubstr("WIDTH"), HasSubstr("\"-2\"")));
  EXPECT_THAT(pcd_refusal(with("DATA ascii", "DATA zip")), AllOf(HasSubstr("DATA"), HasSubstr("\"zip\"")));
  EXPECT_THAT(pcd_refusal(with("300 1 0 0 0", "300")), HasSubstr("VIEWPOINT"));
  EXPECT_THAT(pcd_refusal(with("-200", "inf")), AllOf(HasSubstr("VIEWPOINT"), HasSubstr("\"inf\"")));
}

TEST(ReadPcd, RefusesAWordThatIsNoNumber) {
  EXPECT_THAT(pcd_refusal(with(" 2 3", " two 3")), AllOf(HasSubstr("Point 0 of 2"), HasSubstr("no number")));
}

TEST(ReadPcd, RefusesCompressedDataOfAnotherSizeThanItsPoints) {
  std::string bytes = compressed_pcd();
  bytes[bytes.find("compressed\n") + 11 + 4] = 99;
  EXPECT_THAT(pcd_refusal(bytes), AllOf(HasSubstr("99 bytes"), HasSubstr("32")));
}

TEST(ReadPcd, RefusesADecompressionBomb) {
  // 1000 points of 128 x 4096 eight-byte numbers would be 4 GB.
  std::string fields = "x y z", sizes = "4 4 4", types = "F F F", counts = "1 1 1";
  for (int i = 0; i < 20; ++i) {
    absl::StrAppend(&fields, " h", i);
    sizes += " 8";
    types += " F";
    counts += " 4096";
  }
  std::string bytes = absl::StrCat("VERSION 0.7\nFIELDS ", fields, "\nSIZE ", sizes, "\nTYPE ", types, "\nCOUNT ",
                                   counts, "\nWIDTH 1000\nHEIGHT 1\nDATA binary_compressed\n");
  const std::array<std::uint32_t, 2> stated = {3, 1000 * (12 + 20 * 8 * 4096)};
  bytes.append(reinterpret_cast<const char*>(stated.data()), sizeof(stated)).append("abc");
  EXPECT_THAT(pcd_refusal(bytes, absl::StatusCode::kResourceExhausted), HasSubstr("limit"));
}

}  // namespace
}  // namespace binpose

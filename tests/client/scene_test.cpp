#include "client/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "tests/client/temporary_directory.h"

namespace binpose::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::string_view kCamera = R"({"width": 3, "height": 2, "fx": 500, "fy": 501, "cx": 1.5, "cy": 1,
                                         "depth_unit_mm": 0.02, "depth_file": "depth.pgm"})";
constexpr std::array<std::uint16_t, 6> kDepth = {0, 1, 255, 256, 40000, 65535};

std::string depth_bytes(bool is_big_endian) {
  std::string bytes;
  for (const std::uint16_t value : kDepth) {
    const auto high = static_cast<char>(value >> 8), low = static_cast<char>(value & 0xff);
    bytes += is_big_endian ? std::string{high, low} : std::string{low, high};
  }
  return bytes;
}

std::string pgm() { return "P5\n# made by a test\n3 2\n65535\n" + depth_bytes(true); }

/// A PNG file as libpng writes it.
std::string png(std::uint32_t format = PNG_FORMAT_LINEAR_Y) {
  png_image image;
  std::memset(&image, 0, sizeof(image));
  image.version = PNG_IMAGE_VERSION;
  image.width = 3;
  image.height = 2;
  image.format = format;
  const std::vector<std::uint16_t> pixels(kDepth.begin(), kDepth.end());
  png_alloc_size_t size = 0;
  png_image_write_to_memory(&image, nullptr, &size, 0, pixels.data(), 0, nullptr);
  std::string bytes(size, '\0');
  png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr);
  bytes.resize(size);
  return bytes;
}

class SceneTest : public ::testing::Test {
 protected:
  std::string refusal(const std::filesystem::path& path, const std::optional<std::filesystem::path>& camera = {}) {
    const absl::StatusOr<v1::PointCloud> cloud = read_scene(path, camera, v1::LENGTH_UNIT_MILLIMETRE);
    EXPECT_FALSE(cloud.ok());
    EXPECT_THAT(std::string(cloud.status().message()), HasSubstr(files_.path().string()));
    return std::string(cloud.status().message());
  }

  TemporaryDirectory files_;
};

TEST(CloudFromPoints, PacksTheNumbersAsTheyAre) {
  const v1::PointCloud cloud = cloud_from_points(std::vector<float>{1, 2, 3, 4, 5, 6, 7}, v1::LENGTH_UNIT_METRE);
  EXPECT_EQ(cloud.unit(), v1::LENGTH_UNIT_METRE);
  EXPECT_EQ(cloud.points().width(), 2u);
  EXPECT_EQ(cloud.points().height(), 1u);
  ASSERT_EQ(cloud.points().xyz().size(), 24u);
  float last = 0;
  std::memcpy(&last, cloud.points().xyz().data() + 20, sizeof(last));
  EXPECT_EQ(last, 6);
}

TEST_F(SceneTest, PlyAndPcdAreSentAsTheyAre) {
  const auto ply = read_scene(files_.write("a.ply", "ply\nformat"), {}, v1::LENGTH_UNIT_METRE);
  ASSERT_TRUE(ply.ok()) << ply.status();
  EXPECT_EQ(ply->ply(), "ply\nformat");
  EXPECT_EQ(ply->unit(), v1::LENGTH_UNIT_METRE);
  const auto pcd = read_scene(files_.write("a.pcd", "# .PCD v0.7\n"), {}, v1::LENGTH_UNIT_MILLIMETRE);
  ASSERT_TRUE(pcd.ok()) << pcd.status();
  EXPECT_EQ(pcd->pcd(), "# .PCD v0.7\n");
}

TEST_F(SceneTest, AFolderOrItsCameraFileGivesTheDepthImage) {
  files_.write("depth.pgm", pgm());
  const std::filesystem::path camera = files_.write("camera.json", kCamera);
  for (const std::filesystem::path& path : {files_.path(), camera}) {
    const auto cloud = read_scene(path, {}, v1::LENGTH_UNIT_MILLIMETRE);
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    EXPECT_EQ(cloud->depth().width(), 3u);
    EXPECT_EQ(cloud->depth().height(), 2u);
    EXPECT_EQ(cloud->depth().uint16(), depth_bytes(false));
    EXPECT_DOUBLE_EQ(cloud->depth().depth_scale(), 0.02);
    EXPECT_EQ(cloud->depth().intrinsics().fy(), 501);
    EXPECT_EQ(cloud->depth().intrinsics().cx(), 1.5);
  }
}

TEST_F(SceneTest, DepthComesInTheUnitOfTheRequest) {
  files_.write("depth.pgm", pgm());
  files_.write("camera.json", kCamera);
  const auto cloud = read_scene(files_.path(), {}, v1::LENGTH_UNIT_METRE);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_DOUBLE_EQ(cloud->depth().depth_scale(), 0.00002);
}

TEST_F(SceneTest, APngHoldsTheSameDepthAsAPgm) {
  const std::filesystem::path camera = files_.write("camera.json", kCamera);
  const auto cloud = read_scene(files_.write("image.png", png()), camera, v1::LENGTH_UNIT_MILLIMETRE);
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(cloud->depth().uint16(), depth_bytes(false));
}

TEST_F(SceneTest, RefusesWhatIsNotThere) {
  EXPECT_THAT(refusal(files_.path() / "missing.ply"), HasSubstr("missing.ply"));
  EXPECT_THAT(refusal(files_.path()), HasSubstr("camera.json"));
  files_.write("camera.json", kCamera);
  EXPECT_THAT(refusal(files_.path()), HasSubstr("depth.pgm"));
  EXPECT_THAT(refusal(files_.write("empty.pcd", "")), HasSubstr("empty"));
}

TEST_F(SceneTest, RefusesAnImageWithoutItsCamera) {
  EXPECT_THAT(refusal(files_.write("depth.png", png())), HasSubstr("camera file"));
}

TEST_F(SceneTest, RefusesADamagedCameraFileAndNamesTheField) {
  const std::filesystem::path image = files_.write("depth.pgm", pgm());
  EXPECT_THAT(refusal(image, files_.write("camera.json", "{")), HasSubstr("no JSON"));
  EXPECT_THAT(refusal(image, files_.write("camera.json", R"({"width": 3})")), HasSubstr("lacks the number height"));
  EXPECT_THAT(refusal(image, files_.write("camera.json", R"({"width": 2.5})")), HasSubstr("whole number"));
  EXPECT_THAT(refusal(image, files_.write("camera.json", R"({"width": -1})")),
              AllOf(HasSubstr("width"), HasSubstr("-1")));
}

TEST_F(SceneTest, RefusesAnImageOfAnotherSizeThanItsCamera) {
  const std::filesystem::path camera = files_.write("camera.json", kCamera);
  EXPECT_THAT(refusal(files_.write("depth.pgm", "P5 2 3 65535\n" + depth_bytes(true)), camera),
              AllOf(HasSubstr("2 x 3"), HasSubstr("3 x 2")));
}

TEST_F(SceneTest, RefusesImagesThatAreNot16BitDepth) {
  const std::filesystem::path camera = files_.write("camera.json", kCamera);
  EXPECT_THAT(refusal(files_.write("depth.pgm", "P5 3 2 255\n123456"), camera), HasSubstr("255"));
  EXPECT_THAT(refusal(files_.write("depth.png", png(PNG_FORMAT_GRAY)), camera), HasSubstr("16 bits"));
  EXPECT_THAT(refusal(files_.write("depth.jpg", "\xff\xd8\xff"), camera), HasSubstr("neither PGM"));
}

TEST_F(SceneTest, RefusesTruncatedImages) {
  const std::filesystem::path camera = files_.write("camera.json", kCamera);
  const std::string whole_pgm = pgm(), whole_png = png();
  for (std::size_t size = 2; size < whole_pgm.size(); ++size) {
    refusal(files_.write("depth.pgm", whole_pgm.substr(0, size)), camera);
  }
  // The last chunk of a PNG, of 12 bytes, holds nothing.
  for (std::size_t size = 8; size < whole_png.size() - 12; ++size) {
    refusal(files_.write("depth.png", whole_png.substr(0, size)), camera);
  }
}

}  // namespace
}  // namespace binpose::client

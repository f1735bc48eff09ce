#include "tests/scenes/make_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/scenes/penetration.h"
#include "tests/scenes/ray_scene.h"
#include "tests/support/bin_scene.h"

namespace binpose::scenes {
namespace {

namespace fs = std::filesystem;

const fs::path kData = BINPOSE_TEST_DATA;

const testing::ScenePart& part_named(const std::string& name) {
  static const std::vector<testing::ScenePart> parts = testing::read_parts(kData / "parts");
  return *std::find_if(parts.begin(), parts.end(), [&](const auto& part) { return part.name == name; });
}

/// Six spindles, made once with each seed.
Scene small_scene(std::uint64_t seed) {
  const Mesh& part = part_named("spindle").mesh;
  SceneParams params;
  params.count = 6;
  return make_scene("spindle", part, convex_pieces(part, 0.002), params, seed).value();
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class MakeScene : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  const fs::path folder_ = fs::temp_directory_path() / ("binpose-scene-" + std::to_string(std::random_device{}()));
};

TEST_F(MakeScene, GivesTheSameBytesForTheSameSeedAndOthersForAnother) {
  ASSERT_TRUE(write_scene(small_scene(1), folder_ / "a", true).ok());
  ASSERT_TRUE(write_scene(small_scene(1), folder_ / "b", true).ok());
  ASSERT_TRUE(write_scene(small_scene(2), folder_ / "c", true).ok());
  for (const char* file : {"depth.png", "camera.json", "gt.json", "scene.ply"}) {
    ASSERT_GT(bytes_of(folder_ / "a" / file).size(), 100) << file;
    EXPECT_EQ(bytes_of(folder_ / "a" / file), bytes_of(folder_ / "b" / file)) << file;
    EXPECT_NE(bytes_of(folder_ / "a" / file), bytes_of(folder_ / "c" / file)) << file;
  }
}

TEST_F(MakeScene, LeavesPartsInTheBinAndApart) {
  const Scene scene = small_scene(3);
  std::vector<Pose> T_bin_models;
  for (const Instance& instance : scene.scan.instances) {
    T_bin_models.push_back(scene.scan.T_scene_bin.inverse() * instance.T_scene_model);
  }
  const Mesh& part = part_named("spindle").mesh;
  ASSERT_GE(T_bin_models.size(), 4);
  EXPECT_LT(deepest_penetration(part, T_bin_models), 0.0002);
  EXPECT_LT(deepest_outside(part, T_bin_models, scene.bin), 0.0002);
}

TEST_F(MakeScene, ReadsBackAsItWasScanned) {
  const Scene scene = small_scene(1);
  ASSERT_TRUE(write_scene(scene, folder_, false).ok());
  const testing::BinScene read = testing::read_scene(folder_);
  EXPECT_EQ(read.part, "spindle");
  ASSERT_EQ(read.cloud.points.size(), scene.scan.cloud.points.size());
  for (std::size_t i = 0; i < read.cloud.points.size(); ++i) {
    const Eigen::Vector3f &a = scene.scan.cloud.points[i], &b = read.cloud.points[i];
    ASSERT_EQ(std::isnan(a.z()), std::isnan(b.z()));
    if (std::isnan(a.z())) continue;
    ASSERT_LT((a - b).norm(), 2e-5);  // half a depth unit, a little more at the border
  }
  ASSERT_EQ(read.instances.size(), scene.scan.instances.size());
  for (std::size_t i = 0; i < read.instances.size(); ++i) {
    EXPECT_TRUE(read.instances[i].T_scene_model.isApprox(scene.scan.instances[i].T_scene_model, 1e-9));
  }
}

TEST_F(MakeScene, RefusesAPlaceWhereItCannotWrite) {
  std::ofstream(folder_ / "file") << "in the way";
  const absl::Status status = write_scene(small_scene(1), folder_ / "file" / "scene", false);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(status.message().find("file/scene"), std::string::npos) << status;
}

/// Each pile of tests/data/scenes.
class DataScene : public ::testing::TestWithParam<std::string> {
 protected:
  const testing::BinScene scene_ = testing::read_scene(kData / "scenes" / GetParam());
  const Mesh& part_ = part_named(scene_.part).mesh;
};

TEST_P(DataScene, HasItsPosedMeshesOnTheCloudWithinTheNoise) {
  RayScene truth;
  for (const auto& instance : scene_.instances) truth.add(part_, instance.T_scene_model);
  truth.build();
  std::vector<double> errors;
  for (const Eigen::Vector3f& point : scene_.cloud.points) {
    if (std::isnan(point.z())) continue;
    const Eigen::Vector3d p = point.cast<double>();
    const auto hit = truth.cast(Eigen::Vector3d::Zero(), p.normalized());
    if (hit) errors.push_back(std::abs(hit->distance - p.norm()));
  }
  ASSERT_GT(errors.size(), 10000);
  std::sort(errors.begin(), errors.end());
  const auto quantile = [&](double share) { return errors[static_cast<std::size_t>(share * errors.size())]; };
  EXPECT_NEAR(quantile(0.5), 0.6745 * 0.00012, 0.00001);  // half of a normal distribution lies within 0.67 sigma
  EXPECT_LT(quantile(0.94), 3 * 0.00012);                 // the rest flies at the edges
}

TEST_P(DataScene, HasNoPartsInEachOther) {
  std::vector<Pose> poses;
  for (const auto& instance : scene_.instances) poses.push_back(instance.T_scene_model);
  EXPECT_LT(deepest_penetration(part_, poses), 0.0002);
}

TEST(EmptyBin, HoldsNothing) {
  const testing::BinScene scene = testing::read_scene(kData / "scenes" / "empty_bin_01");
  EXPECT_TRUE(scene.instances.empty());
  const auto measured = [](const Eigen::Vector3f& point) { return !std::isnan(point.z()); };
  EXPECT_GT(std::count_if(scene.cloud.points.begin(), scene.cloud.points.end(), measured), 50000);
}

INSTANTIATE_TEST_SUITE_P(All, DataScene,
                         ::testing::Values("bearing_support_01", "bearing_support_02", "bearing_support_03",
                                           "spindle_01", "lock_plate_01"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace binpose::scenes

#include "tests/scenes/scene_files.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "absl/strings/str_cat.h"

namespace binpose::scenes {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDepthUnitMm = 0.02;

/// Millimetres, to the nanometre.
double mm(double metres) { return std::round(metres * 1e9) / 1e6; }

Json mm_pose(const Pose& pose) {
  Json numbers = Json::array();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      const double value = pose.matrix()(row, column);
      numbers.push_back(row < 3 && column == 3 ? mm(value) : std::round(value * 1e12) / 1e12);
    }
  }
  return numbers;
}

absl::Status write_depth(const PointCloud& cloud, const std::filesystem::path& path) {
  std::vector<std::uint16_t> depth;
  for (const auto& point : cloud.points) {
    const double value = std::round(point.z() * 1000 / kDepthUnitMm);
    depth.push_back(value <= 0xffff ? static_cast<std::uint16_t>(value) : 0);  // NaN compares false
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = cloud.width;
  image.height = cloud.height;
  image.format = PNG_FORMAT_LINEAR_Y;
  if (png_image_write_to_file(&image, path.c_str(), 0, depth.data(), 0, nullptr)) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot write ", path.string(), ": ", image.message));
}

absl::Status write_text(const std::string& text, const std::filesystem::path& path) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (file.flush()) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot write ", path.string()));
}

Json camera_json(const PointCloud& cloud) {
  return {{"width", cloud.width},       {"height", cloud.height},       {"fx", cloud.intrinsics->fx},
          {"fy", cloud.intrinsics->fy}, {"cx", cloud.intrinsics->cx},   {"cy", cloud.intrinsics->cy},
          {"depth_file", "depth.png"},  {"depth_unit_mm", kDepthUnitMm}};
}

Json truth_json(const Scene& scene) {
  Json truth{{"part", scene.part},
             {"seed", scene.seed},
             {"resolution_mm", mm(scene.scanner.point_spacing)},
             {"noise_sigma_mm", mm(scene.scanner.noise)},
             {"bin",
              {{"length", mm(scene.bin.length)},
               {"width", mm(scene.bin.width)},
               {"height", mm(scene.bin.height)},
               {"wall", mm(scene.bin.wall)},
               {"pose", mm_pose(scene.scan.T_scene_bin)}}},
             {"instances", Json::array()}};
  for (const Instance& instance : scene.scan.instances) {
    const double alone = std::max(instance.alone_points, 1);
    truth["instances"].push_back(
        {{"pose", mm_pose(instance.T_scene_model)},
         {"visibility", std::min(1.0, std::round(instance.visible_points / alone * 1e4) / 1e4)},
         {"visible_points", instance.visible_points}});
  }
  return truth;
}

std::string ply(const PointCloud& cloud) {
  std::string bytes;
  int count = 0;
  for (const auto& point : cloud.points) {
    if (std::isnan(point.z())) continue;
    const Eigen::Vector3f mm_point = point * 1000;
    bytes.append(reinterpret_cast<const char*>(mm_point.data()), sizeof(mm_point));
    ++count;
  }
  return absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ", count,
                      "\nproperty float x\nproperty float y\nproperty float z\nend_header\n", bytes);
}

}  // namespace

absl::Status write_scene(const Scene& scene, const std::filesystem::path& folder, bool with_ply) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return absl::UnavailableError(absl::StrCat("cannot make ", folder.string(), ": ", failed.message()));
  const PointCloud& cloud = scene.scan.cloud;
  absl::Status status = write_depth(cloud, folder / "depth.png");
  status.Update(write_text(camera_json(cloud).dump(1) + "\n", folder / "camera.json"));
  if (with_ply) status.Update(write_text(ply(cloud), folder / "scene.ply"));
  status.Update(write_text(truth_json(scene).dump(1) + "\n", folder / "gt.json"));  // last: a folder with it is whole
  return status;
}

}  // namespace binpose::scenes

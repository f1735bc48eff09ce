#include "tests/support/bin_scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "core/io/read_mesh.h"
#include "tests/support/read_png.h"

namespace binpose::testing {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr double kMillimetre = 0.001;

std::string read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(file), {}};
}

Json read_json(const fs::path& path) { return Json::parse(read_bytes(path)); }

/// 16 row-major numbers, lengths in millimetres.
Pose read_pose(const Json& values) {
  Pose pose = Pose::Identity();
  for (int i = 0; i < 12; ++i) {
    pose.matrix()(i / 4, i % 4) = values.at(i).get<double>() * (i % 4 == 3 ? kMillimetre : 1);
  }
  return pose;
}

Eigen::Vector3d read_vector(const Json& values) {
  return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

std::vector<std::uint16_t> read_pgm(const fs::path& path, std::size_t count) {
  const std::string bytes = read_bytes(path);
  if (bytes.size() < 2 * count) throw std::runtime_error(path.string() + " is too short");
  std::vector<std::uint16_t> values(count);
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data() + bytes.size() - 2 * count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<std::uint16_t>(data[2 * i] << 8 | data[2 * i + 1]);
  return values;
}

PointCloud read_depth(const fs::path& folder) {
  const Json camera = read_json(folder / "camera.json");
  PointCloud cloud;
  cloud.width = camera.at("width");
  cloud.height = camera.at("height");
  const CameraIntrinsics k{camera.at("fx"), camera.at("fy"), camera.at("cx"), camera.at("cy")};
  cloud.intrinsics = k;
  const fs::path file = folder / camera.at("depth_file").get<std::string>();
  const std::size_t count = static_cast<std::size_t>(cloud.width) * cloud.height;
  const std::vector<std::uint16_t> values =
      file.extension() == ".pgm" ? read_pgm(file, count) : read_png16(file, count);
  const double unit = camera.at("depth_unit_mm").get<double>() * kMillimetre;
  cloud.points.assign(count, Eigen::Vector3f::Constant(NAN));
  for (std::size_t i = 0; i < count; ++i) {
    if (values[i] == 0) continue;
    const double z = values[i] * unit;
    const std::size_t u = i % cloud.width, v = i / cloud.width;
    cloud.points[i] =
        Eigen::Vector3d((static_cast<double>(u) - k.cx) / k.fx * z, (static_cast<double>(v) - k.cy) / k.fy * z, z)
            .cast<float>();
  }
  return cloud;
}

/// Binary PLY of float x y z, as the scenes have it.
PointCloud read_ply(const fs::path& path) {
  const std::string bytes = read_bytes(path);
  const std::size_t head = bytes.find("end_header\n") + 11;
  PointCloud cloud;
  cloud.width = static_cast<std::uint32_t>((bytes.size() - head) / 12);
  cloud.height = 1;
  cloud.points.resize(cloud.width);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    std::memcpy(cloud.points[i].data(), bytes.data() + head + 12 * i, 12);
    cloud.points[i] *= static_cast<float>(kMillimetre);
  }
  return cloud;
}

}  // namespace

std::vector<ScenePart> read_parts(const fs::path& folder) {
  std::vector<ScenePart> parts;
  const Json list = read_json(folder / "parts.json");
  for (const Json& entry : list.at("parts")) {
    ScenePart part;
    part.name = entry.at("name");
    part.diameter = entry.at("diameter").get<double>() * kMillimetre;
    absl::StatusOr<Mesh> mesh =
        read_mesh(read_bytes(folder / entry.at("file").get<std::string>()), MeshFormat::kDetect, kMillimetre);
    if (!mesh.ok()) throw std::runtime_error(mesh.status().ToString());
    part.mesh = *std::move(mesh);
    for (const Json& pose : entry.at("symmetry").at("discrete")) part.discrete_symmetry.push_back(read_pose(pose));
    const Json& axis = entry.at("symmetry").at("continuous");
    part.has_axis = !axis.is_null();
    if (part.has_axis) {
      part.axis_point = read_vector(axis.at("point")) * kMillimetre;
      part.axis_direction = read_vector(axis.at("direction")).normalized();
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

BinScene read_scene(const fs::path& folder, bool prefer_ply) {
  const Json gt = read_json(folder / "gt.json");
  BinScene scene;
  scene.name = folder.filename();
  scene.part = gt.at("part");
  scene.cloud = prefer_ply && fs::exists(folder / "scene.ply") ? read_ply(folder / "scene.ply") : read_depth(folder);
  for (const Json& instance : gt.at("instances")) {
    scene.instances.push_back({read_pose(instance.at("pose")), instance.at("visibility")});
  }
  return scene;
}

std::vector<fs::path> scene_folders(const fs::path& folder, const std::string& filter) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (fs::exists(entry.path() / "gt.json") && entry.path().filename().string().find(filter) != std::string::npos) {
      found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace binpose::testing

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/mesh.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/pose.h"

namespace binpose::testing {

/// A part that scenes are made of; metres.
struct ScenePart {
  std::string name;
  Mesh mesh;
  double diameter = 0;
  std::vector<Pose> discrete_symmetry;  ///< T_model_model, identity first
  bool has_axis = false;
  Eigen::Vector3d axis_point = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_direction = Eigen::Vector3d::UnitZ();
};

/// A part in a bin, as it truly lies.
struct SceneInstance {
  Pose T_scene_model;
  double visibility = 0;  ///< visible points over those if it lay there alone
};

/// A scan with its truth.
struct BinScene {
  std::string name;
  std::string part;
  PointCloud cloud;
  std::vector<SceneInstance> instances;
};

/// The parts of a folder with parts.json and STL files in millimetres. Throws std::runtime_error.
std::vector<ScenePart> read_parts(const std::filesystem::path& folder);

/// The scan and truth of a scene folder: gt.json with camera.json and a depth image, or with scene.ply when
/// `prefer_ply` is set and it exists. Throws std::runtime_error.
BinScene read_scene(const std::filesystem::path& folder, bool prefer_ply = false);

/// The scene folders in a folder whose names hold `filter`, by name.
std::vector<std::filesystem::path> scene_folders(const std::filesystem::path& folder, const std::string& filter);

}  // namespace binpose::testing

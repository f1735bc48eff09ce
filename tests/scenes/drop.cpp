#include "tests/scenes/drop.h"

#include <algorithm>
#include <cmath>

#include "absl/status/status.h"
#include "tests/scenes/rigid_bodies.h"

namespace binpose::scenes {
namespace {

/// Four walls around the inside of the bin; thick outwards, so that nothing is ever pushed through.
std::vector<btRigidBody*> add_walls(RigidBodies& bodies, const Bin& bin, double bottom, double top) {
  const double x = bin.length / 2, y = bin.width / 2, thick = 0.2;
  using Corner = Eigen::Vector3d;
  return {bodies.add_block({Corner(-x - thick, -y - thick, bottom), Corner(-x, y + thick, top)}),
          bodies.add_block({Corner(x, -y - thick, bottom), Corner(x + thick, y + thick, top)}),
          bodies.add_block({Corner(-x, -y - thick, bottom), Corner(x, -y, top)}),
          bodies.add_block({Corner(-x, y, bottom), Corner(x, y + thick, top)})};
}

/// Hangs the parts above the bin, layer upon layer, where none touches another however it is turned.
std::vector<btRigidBody*> hang_parts(RigidBodies& bodies, const Mesh& part, const Bin& bin, int count, Random& random) {
  Eigen::AlignedBox3f box;
  for (const auto& vertex : part.vertices) box.extend(vertex);
  const Eigen::Vector3d centre = box.center().cast<double>();
  double radius = 0;
  for (const auto& vertex : part.vertices) radius = std::max(radius, (vertex.cast<double>() - centre).norm());

  const int columns = std::max(1, static_cast<int>(bin.length / (2 * radius)));
  const int rows = std::max(1, static_cast<int>(bin.width / (2 * radius)));
  const Eigen::Vector3d pitch(bin.length / columns, bin.width / rows, 2 * radius);
  std::vector<btRigidBody*> parts;
  parts.reserve(count);
  for (int i = 0; i < count; ++i) {
    const int column = i % columns, row = i / columns % rows, layer = i / columns / rows;
    Eigen::Vector3d place((column + 0.5) * pitch.x() - bin.length / 2, (row + 0.5) * pitch.y() - bin.width / 2,
                          bin.height + (layer + 0.5) * pitch.z());
    for (int axis = 0; axis < 2; ++axis) {
      const double slack = pitch[axis] / 2 - radius;
      place[axis] += random.uniform(-slack, slack);
    }
    const Pose T_bin_model = Eigen::Translation3d(place) * random.rotation() * Eigen::Translation3d(-centre);
    const Eigen::Vector3d spin(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
    parts.push_back(bodies.add_part(T_bin_model, spin));
  }
  return parts;
}

std::vector<Pose> poses_of(const RigidBodies& bodies, const std::vector<btRigidBody*>& parts) {
  std::vector<Pose> poses;
  poses.reserve(parts.size());
  for (const btRigidBody* body : parts) poses.push_back(bodies.pose_of(*body));
  return poses;
}

/// Waits until no part goes anywhere; trembling where they touch does not count.
bool settle(RigidBodies& bodies, const std::vector<btRigidBody*>& parts) {
  constexpr double kLongest = 10, kPause = 0.2;         // seconds
  constexpr double kStill = 0.0003, kStillTurn = 0.01;  // metres and radians per pause
  std::vector<Pose> before = poses_of(bodies, parts);
  for (double start = 0; start < kLongest; start += kPause) {
    for (double time = 0; time < kPause; time += RigidBodies::kTimeStep) bodies.step();
    const std::vector<Pose> now = poses_of(bodies, parts);
    const bool still = std::equal(now.begin(), now.end(), before.begin(), [&](const Pose& a, const Pose& b) {
      return (a.translation() - b.translation()).norm() < kStill && rotation_distance(a, b) < kStillTurn;
    });
    if (still) return true;
    before = now;
  }
  return false;
}

bool stands_over_the_floor(const Mesh& part, const Pose& T_bin_model, const Bin& bin) {
  return std::all_of(part.vertices.begin(), part.vertices.end(), [&](const Eigen::Vector3f& vertex) {
    const Eigen::Vector3d placed = T_bin_model * vertex.cast<double>();
    return std::abs(placed.x()) < bin.length / 2 && std::abs(placed.y()) < bin.width / 2;
  });
}

}  // namespace

absl::StatusOr<std::vector<Pose>> drop_parts(const Mesh& part, const std::vector<ConvexPiece>& pieces, const Bin& bin,
                                             int count, Random random) {
  RigidBodies bodies(part, pieces);
  const double x = bin.length, y = bin.width;
  bodies.add_block({Eigen::Vector3d(-x, -y, -0.2), Eigen::Vector3d(x, y, 0)});
  add_walls(bodies, bin, 0, bin.height);
  const std::vector<btRigidBody*> chimney = add_walls(bodies, bin, bin.height, 10);
  std::vector<btRigidBody*> parts = hang_parts(bodies, part, bin, count, random);

  bool still = settle(bodies, parts);
  for (btRigidBody* wall : chimney) bodies.remove(wall);
  for (std::size_t before = 0; still && before != parts.size();) {
    still = settle(bodies, parts);
    before = parts.size();
    std::erase_if(parts, [&](btRigidBody* body) {
      const bool out = !stands_over_the_floor(part, bodies.pose_of(*body), bin);
      if (out) bodies.remove(body);
      return out;
    });
  }
  if (!still) return absl::DeadlineExceededError("the pile still moves after 10 simulated seconds");

  return poses_of(bodies, parts);
}

}  // namespace binpose::scenes

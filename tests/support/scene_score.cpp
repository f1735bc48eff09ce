#include "tests/support/scene_score.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "core/geometry/view_sphere.h"

namespace binpose::testing {
namespace {

constexpr double kRightDistance = 0.1;  // of the diameter
constexpr double kCounted = 0.5;        // visibility
constexpr int kAxisSteps = 180;

/// Vertices that are outermost in some direction: the largest distance between two rigid images is reached on them.
std::vector<Eigen::Vector3d> outermost(const Mesh& mesh) {
  std::set<std::size_t> indices;
  for (const Eigen::Vector3f& direction : view_directions(300)) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < mesh.vertices.size(); ++i) {
      if (direction.dot(mesh.vertices[i]) > direction.dot(mesh.vertices[best])) best = i;
    }
    indices.insert(best);
  }
  std::vector<Eigen::Vector3d> points;
  points.reserve(indices.size());
  for (const std::size_t i : indices) points.emplace_back(mesh.vertices[i].cast<double>());
  return points;
}

}  // namespace

SceneScore& SceneScore::operator+=(const SceneScore& other) {
  scenes += other.scenes;
  best_right += other.best_right;
  instances += other.instances;
  hits += other.hits;
  wrong += other.wrong;
  return *this;
}

PoseJudge::PoseJudge(const ScenePart& part) : diameter_(part.diameter), points_(outermost(part.mesh)) {
  std::vector<Pose> motions;
  for (const Pose& discrete : part.discrete_symmetry) {
    for (int step = 0; step < (part.has_axis ? kAxisSteps : 1); ++step) {
      const Pose turn = Eigen::Translation3d(part.axis_point) *
                        Eigen::AngleAxisd(2 * std::numbers::pi * step / kAxisSteps, part.axis_direction) *
                        Eigen::Translation3d(-part.axis_point);
      motions.push_back(discrete * turn);
    }
  }
  for (const Pose& motion : motions) {
    std::vector<Eigen::Vector3d> moved;
    for (const Eigen::Vector3d& p : points_) moved.push_back(motion * p);
    moved_.push_back(std::move(moved));
  }
}

double PoseJudge::surface_distance(const Pose& estimate, const Pose& truth) const {
  const Pose T_truth_estimate = truth.inverse() * estimate;
  std::vector<Eigen::Vector3d> estimated;
  for (const Eigen::Vector3d& p : points_) estimated.push_back(T_truth_estimate * p);
  double best = INFINITY;
  for (const std::vector<Eigen::Vector3d>& moved : moved_) {
    double largest = 0;
    for (std::size_t i = 0; i < points_.size() && largest < best; ++i) {
      largest = std::max(largest, (moved[i] - estimated[i]).squaredNorm());
    }
    best = std::min(best, largest);
  }
  return std::sqrt(best);
}

bool PoseJudge::right(const Pose& estimate, const Pose& truth) const {
  return surface_distance(estimate, truth) <= kRightDistance * diameter_;
}

SceneScore PoseJudge::score(std::span<const PoseHypothesis> hypotheses, std::span<const SceneInstance> instances,
                            std::vector<int>* verdicts) const {
  SceneScore score;
  score.scenes = 1;
  score.instances = static_cast<int>(std::count_if(instances.begin(), instances.end(),
                                                   [](const SceneInstance& i) { return i.visibility >= kCounted; }));
  if (verdicts != nullptr) verdicts->clear();
  std::vector<bool> free(instances.size(), true);
  for (std::size_t h = 0; h < hypotheses.size(); ++h) {
    int best = -1;
    double best_distance = kRightDistance * diameter_;
    bool best_counted = false;
    for (std::size_t i = 0; i < instances.size(); ++i) {
      const bool counted = instances[i].visibility >= kCounted;
      const Eigen::Vector3d apart =
          (hypotheses[h].T_scene_model * points_[0]) - (instances[i].T_scene_model * points_[0]);
      if (apart.norm() > 1.2 * diameter_) continue;
      const double distance = surface_distance(hypotheses[h].T_scene_model, instances[i].T_scene_model);
      if (distance > kRightDistance * diameter_) continue;
      if (h == 0) score.best_right = 1;
      if (!free[i] || (best >= 0 && best_counted && !counted)) continue;
      if (best < 0 || (counted && !best_counted) || distance < best_distance) {
        best = static_cast<int>(i);
        best_distance = distance;
        best_counted = counted;
      }
    }
    if (best >= 0) free[best] = false;
    score.hits += best >= 0 && best_counted;
    score.wrong += best < 0;
    if (verdicts != nullptr) verdicts->push_back(best < 0 ? -1 : (best_counted ? 1 : 0));
  }
  return score;
}

}  // namespace binpose::testing

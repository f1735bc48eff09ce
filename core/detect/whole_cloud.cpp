#include "core/detect/whole_cloud.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/container/flat_hash_set.h"
#include "core/detect/refine.h"

namespace binpose {
namespace {

constexpr float kCell = 0.05F;     // diameters
constexpr float kMostCells = 100;  // along each axis
constexpr float kReach = 2;        // cells
constexpr int kIterations = 8;
constexpr std::size_t kMostPoints = 1000;  // that a pose is refined with
constexpr int kFewestPoints = 12;
/// Weight of staying put, relative to the mean curvature: holds directions that the planes leave free.
constexpr double kDamping = 1e-4;

/// Normal equations of one Gauss-Newton step; unknowns: small rotation about the centre, then translation; model frame.
struct Step {
  Matrix6d A = Matrix6d::Zero();
  Twist b = Twist::Zero();
  int count = 0;

  /// Draws the surface at `arm` from the centre by `distance` along its normal; the pull of Tukey's biweight ends at
  /// `gate`.
  void add(const Eigen::Vector3f& arm, const Eigen::Vector3f& normal, float distance, float gate) {
    const float relative = distance / gate;
    if (!(std::abs(relative) < 1)) return;
    const double weight = (1 - relative * relative) * (1 - relative * relative);
    Twist row;
    row << arm.cross(normal).cast<double>(), normal.cast<double>();
    A.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    b += weight * distance * row;
    ++count;
  }
};

/// Cells that differ in z only follow each other.
std::uint64_t key_of(const Eigen::Array<std::uint64_t, 3, 1>& cell) {
  return cell.x() << 42 | cell.y() << 21 | cell.z();
}

/// Every n-th, so that at most `most` are left.
std::vector<Eigen::Vector3f> some_of(const WholeCloud& cloud, const std::vector<std::uint32_t>& indices,
                                     std::size_t most) {
  const std::size_t stride = std::max<std::size_t>(1, (indices.size() + most - 1) / most);
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < indices.size(); i += stride) points.push_back(cloud.points()[indices[i]]);
  return points;
}

}  // namespace

WholeCloud::WholeCloud(const SensorView& view, float spacing, float cell, const RunControl& control) : cell_(cell) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : view.points) box.extend(p);
  if (!box.isEmpty()) low_ = box.min();
  absl::flat_hash_set<std::uint64_t> taken;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> kept;
  for (std::size_t i = 0; i < view.points.size() && !control.interrupted_at(i); ++i) {
    if (!taken.insert(key_of(cell_of(view.points[i], spacing))).second) continue;
    kept.emplace_back(key_of(cell_of(view.points[i], cell)), static_cast<std::uint32_t>(i));
  }
  std::sort(kept.begin(), kept.end());
  for (const auto& [at, i] : kept) {
    keys_.push_back(at);
    points_.push_back(view.points[i]);
  }
}

WholeCloud::Cell WholeCloud::cell_of(const Eigen::Vector3f& p, float size) const {
  constexpr float kMost = (1 << 20) - 1;  // what lies beyond shares the last cell
  return ((p - low_).array() / size).max(0.0F).min(kMost).cast<std::uint64_t>();
}

std::vector<std::uint32_t> WholeCloud::in_box(const Eigen::AlignedBox3f& box,
                                              const Eigen::Isometry3f& T_view_model) const {
  Eigen::AlignedBox3f reach;
  for (int i = 0; i < 8; ++i) reach.extend(T_view_model * box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(i)));
  const Eigen::Isometry3f T_model_view = T_view_model.inverse();
  const Cell low = cell_of(reach.min(), cell_), high = cell_of(reach.max(), cell_);
  std::vector<std::uint32_t> found;
  for (std::uint64_t x = low.x(); x <= high.x(); ++x) {
    for (std::uint64_t y = low.y(); y <= high.y(); ++y) {
      const auto first = std::lower_bound(keys_.begin(), keys_.end(), key_of({x, y, low.z()}));
      const auto last = std::upper_bound(first, keys_.end(), key_of({x, y, high.z()}));
      for (auto i = first - keys_.begin(); i < last - keys_.begin(); ++i) {
        if (box.contains(T_model_view * points_[i])) found.push_back(static_cast<std::uint32_t>(i));
      }
    }
  }
  return found;
}

WholeSurface::WholeSurface(const Model& model)
    : model_(model),
      // The second counts only where a model's box does not fit its diameter: it bounds the cells.
      cell_(std::max(kCell * static_cast<float>(model.diameter),
                     static_cast<float>((model.box_max - model.box_min).cwiseAbs().maxCoeff()) / kMostCells)),
      box_(model.box_min.cast<float>() - Eigen::Vector3f::Constant(reach()),
           model.box_max.cast<float>() + Eigen::Vector3f::Constant(reach())) {
  size_ = (box_.sizes().array() / cell_).max(0.0F).cast<int>() + 1;
  first_.assign(static_cast<std::size_t>(size_.prod()) + 1, 0);
  std::vector<int> cells;
  for (const SurfacePoint& point : model.surface) {
    const Eigen::Array3i c = cell_of(point.position);
    cells.push_back((c.x() * size_.y() + c.y()) * size_.z() + c.z());
    ++first_[cells.back() + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  sorted_.resize(cells.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < cells.size(); ++i) sorted_[next[cells[i]]++] = static_cast<int>(i);
}

float WholeSurface::reach() const { return kReach * cell_; }

Eigen::Array3i WholeSurface::cell_of(const Eigen::Vector3f& p_model) const {
  return ((p_model - box_.min()).array() / cell_).cast<int>().max(0).min(size_ - 1);
}

const SurfacePoint* WholeSurface::nearest(const Eigen::Vector3f& p_model, float distance) const {
  if (!box_.contains(p_model)) return nullptr;
  const Eigen::Array3i low = cell_of(p_model - Eigen::Vector3f::Constant(distance));
  const Eigen::Array3i high = cell_of(p_model + Eigen::Vector3f::Constant(distance));
  const SurfacePoint* best = nullptr;
  float least = distance * distance;
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      const int column = (x * size_.y() + y) * size_.z();
      for (int i = first_[column + low.z()]; i < first_[column + high.z() + 1]; ++i) {
        const SurfacePoint& point = model_.surface[sorted_[i]];
        const float sq_distance = (point.position - p_model).squaredNorm();
        if (sq_distance > least) continue;
        least = sq_distance;
        best = &point;
      }
    }
  }
  return best;
}

Eigen::Isometry3f WholeSurface::refine(const WholeCloud& cloud, const Eigen::Isometry3f& T_view_model,
                                       float gate) const {
  Eigen::Isometry3f T = T_view_model;
  const std::vector<Eigen::Vector3f> points = some_of(cloud, cloud.in_box(box_, T), kMostPoints);
  const Eigen::Vector3f centre = model_.centre.cast<float>();
  for (int i = 0; i < kIterations; ++i) {
    const float now = reach() * std::pow(gate / reach(), static_cast<float>(i) / (kIterations - 1));
    const Eigen::Isometry3f T_model_view = T.inverse();
    Step step;
    for (const Eigen::Vector3f& point : points) {
      const Eigen::Vector3f p = T_model_view * point;
      const SurfacePoint* surface = nearest(p, now);
      if (surface != nullptr) step.add(p - centre, surface->normal, surface->normal.dot(p - surface->position), now);
    }
    if (step.count < kFewestPoints) break;
    const Eigen::Matrix<float, 6, 1> motion =
        damped_step(step.A, step.b, kDamping, 0.5 * model_.diameter).cast<float>();
    if (!motion.allFinite()) break;
    T = T * Eigen::Translation3f(motion.tail<3>()) * turn_about(centre, rotation_by(motion.head<3>()));
  }
  T.linear() = Eigen::Quaternionf(T.linear()).normalized().toRotationMatrix();
  return T;
}

std::vector<std::uint32_t> WholeSurface::explained(const WholeCloud& cloud, const Eigen::Isometry3f& T_view_model,
                                                   float tolerance) const {
  /// No point of the surface is farther from one of the list than this.
  const float beside = kRelativeSurfaceSpacing * static_cast<float>(model_.diameter) + tolerance;
  const Eigen::Isometry3f T_model_view = T_view_model.inverse();
  std::vector<std::uint32_t> found;
  for (const std::uint32_t i : cloud.in_box(box_, T_view_model)) {
    const Eigen::Vector3f p = T_model_view * cloud.points()[i];
    const SurfacePoint* surface = nearest(p, std::min(beside, reach()));
    if (surface != nullptr && std::abs(surface->normal.dot(p - surface->position)) <= tolerance) found.push_back(i);
  }
  return found;
}

}  // namespace binpose

#include "core/train/train.h"

#include <algorithm>
#include <cmath>

#include "core/train/contour_pairs.h"
#include "core/train/mesh_extent.h"
#include "core/train/mesh_report.h"
#include "core/train/outlines.h"
#include "core/train/sample_surface.h"
#include "core/train/select.h"
#include "core/train/self_similarity.h"
#include "core/train/shells.h"
#include "core/train/vector_pairs.h"
#include "core/train/visibility.h"

namespace binpose {
namespace {

/// Spacing of the points that stand for the whole surface in projections, as a share of the diameter.
constexpr double kRelativeDenseSpacing = 0.007;
constexpr double kRelativeCell = 0.02;
constexpr double kRelativePixel = 0.014;
constexpr double kRelativeStep = 0.03;
constexpr double kRelativeContourCell = 0.03;
constexpr std::size_t kContourPairs = 3000;
constexpr std::size_t kOutlinePoints = 48;  // per view, for verification
/// Spacing and number of the points that tell a pose from those that look nearly alike.
constexpr double kRelativeTellingSpacing = 0.01;
constexpr std::size_t kMostTelling = 2000;
constexpr std::size_t kMostPoints = 65535;  // indices have 16 bits

/// The surface as points whose normals point outwards, however the mesh is wound: those of a shell are made to agree,
/// then turned to the side from which it is seen.
std::vector<SurfacePoint> oriented_surface(const Mesh& mesh, const Shells& shells, double diameter,
                                           const RunControl& control) {
  std::vector<std::uint32_t> triangle_of;
  std::vector<SurfacePoint> dense = scatter(mesh, kRelativeDenseSpacing * diameter, control, &triangle_of);
  if (control.interrupted()) return dense;
  std::vector<std::uint32_t> shell_of(dense.size());
  for (std::size_t i = 0; i < dense.size(); ++i) {
    if (shells.turned[triangle_of[i]]) dense[i].normal = -dense[i].normal;
    shell_of[i] = shells.first[triangle_of[i]];
  }
  constexpr int kViewsToTellTheSides = 60;
  const std::vector<bool> behind =
      seen_from_behind(dense, shell_of, view_directions(kViewsToTellTheSides), kRelativeCell * diameter, control);
  for (std::size_t i = 0; i < dense.size(); ++i) {
    if (behind[i]) dense[i].normal = -dense[i].normal;
  }
  return dense;
}

/// Share of the points that no viewpoint sees.
double unseen_share(const std::vector<ViewMask>& masks) {
  const auto unseen = std::count_if(masks.begin(), masks.end(), [](const ViewMask& mask) {
    return std::all_of(mask.begin(), mask.end(), [](std::uint64_t word) { return word == 0; });
  });
  return static_cast<double>(unseen) / static_cast<double>(masks.size());
}

/// `most` entries of a list, or all.
std::vector<ContourPoint> evenly_taken(const std::vector<ContourPoint>& all, std::size_t most) {
  std::vector<ContourPoint> kept;
  const std::size_t count = std::min(most, all.size());
  for (std::size_t i = 0; i < count; ++i) kept.push_back(all[i * all.size() / count]);
  return kept;
}

/// Pairs of one scale, selected [Eq. 2-7], appended to the model.
void select_pairs(std::span<const VectorPair> pairs, const std::vector<ViewMask>& masks, std::size_t count,
                  const RunControl& control, Model& model) {
  const int views = model.params.viewpoint_count;
  std::vector<double> obs(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (control.interrupted_at(i)) return;
    obs[i] = observability(masks[pairs[i].p], masks[pairs[i].q1], masks[pairs[i].q2], views);
  }
  std::vector<double> weights;
  if (model.params.selection == PairSelection::kSignalToNoise) {
    for (const double seen : obs) weights.push_back(std::max(seen, 1.0 / views));  // never none: Ph divides
  }
  const std::vector<double> ph =
      occurrence_probability(model.pair_points, pairs, FeatureBins(model.params.bin_width), control, weights);
  if (control.interrupted()) return;
  std::vector<double> values(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (control.interrupted_at(i)) return;
    values[i] = pair_value(obs[i], ph[i], model.params);
  }
  for (const std::size_t i : best_pairs(values, count, control)) {
    model.pairs.push_back(pairs[i]);
    // A vote for a frequent feature says less: its false votes are more.
    model.pair_weights.push_back(static_cast<float>(1 / std::sqrt(ph[i] * static_cast<double>(pairs.size()))));
  }
}

/// The points that tell the model's similar poses apart, thinned to a number that detection can afford.
/// @param dense_area  of the surface that each dense point stands for, square metres.
void add_telling_points(const std::vector<SurfacePoint>& dense, double dense_area, const RunControl& control,
                        Model& model) {
  const std::vector<SurfacePoint> telling = telling_points(dense, model.similar_poses, model.diameter, control);
  double spacing = kRelativeTellingSpacing * model.diameter;
  do {
    model.telling_points = thin_evenly(telling, spacing, control);
    spacing *= 1.2;
  } while (model.telling_points.size() > kMostTelling);
  // By area, so that the evidence does not depend on how many steps of thinning it took.
  const auto count = static_cast<double>(std::max<std::size_t>(1, model.telling_points.size()));
  model.telling_spacing = std::sqrt(dense_area * static_cast<double>(telling.size()) / count);
}

}  // namespace

absl::StatusOr<Model> train(const Mesh& mesh, const TrainParams& params, const RunControl& control,
                            const TrainObserver& observer) {
  const auto enter = [&](TrainStage stage, double progress) {
    if (observer) observer(stage, progress);
    return control.status();
  };
  if (absl::Status status = validate(params); !status.ok()) return status;
  if (absl::Status status = check_mesh(mesh, control); !status.ok()) return status;

  if (absl::Status status = enter(TrainStage::kSampling, 0.0); !status.ok()) return status;
  Model model;
  model.params = params;
  const MeshExtent extent = mesh_extent(mesh, control);
  if (absl::Status status = control.status(); !status.ok()) return status;
  model.diameter = extent.diameter;
  model.box_min = extent.box_min;
  model.box_max = extent.box_max;
  const Shells shells = find_shells(mesh, control);
  const MeshReport report = examine_mesh(mesh, shells, model.diameter, control);
  const std::vector<SurfacePoint> dense = oriented_surface(mesh, shells, model.diameter, control);
  model.surface = thin_evenly(dense, kRelativeSurfaceSpacing * model.diameter, control);
  model.pair_points = thin_evenly(dense, params.relative_sampling * model.diameter, control);
  if (absl::Status status = control.status(); !status.ok()) return status;
  if (model.surface.size() > kMostPoints || model.pair_points.size() > kMostPoints) {
    return absl::InvalidArgumentError(
        "mesh has too much inner or folded surface for its diameter; remove inner structure from the CAD export.");
  }

  if (absl::Status status = enter(TrainStage::kVisibility, 0.1); !status.ok()) return status;
  const std::vector<Eigen::Vector3f> viewpoints = view_directions(params.viewpoint_count);
  // Both in one go, as projecting the dense points takes most of the time.
  std::vector<SurfacePoint> judged = model.surface;
  judged.insert(judged.end(), model.pair_points.begin(), model.pair_points.end());
  model.visibility = visibility(dense, judged, viewpoints, kRelativeCell * model.diameter, control);
  const auto of_pairs = model.visibility.begin() + static_cast<std::ptrdiff_t>(model.surface.size());
  const std::vector<ViewMask> pair_masks(of_pairs, model.visibility.end());
  model.visibility.erase(of_pairs, model.visibility.end());
  model.warnings = mesh_warnings(report, unseen_share(model.visibility));

  std::vector<std::vector<ContourPoint>> views = outlines(
      dense, viewpoints, model.diameter, kRelativePixel * model.diameter, kRelativeStep * model.diameter, control);
  const std::vector<PooledContour> contours = pool_contours(views, kRelativeContourCell * model.diameter, control);
  for (const PooledContour& contour : contours) model.contour_points.push_back(contour.point);
  RatedContourPairs rated =
      select_contour_pairs(contours, model.diameter, kContourPairs, params.viewpoint_count, control);
  model.contour_pairs = std::move(rated.pairs);
  model.contour_weights = std::move(rated.weights);
  for (const std::vector<ContourPoint>& view : views) model.outlines.push_back(evenly_taken(view, kOutlinePoints));

  const int scales = static_cast<int>(params.pair_lengths.size());
  const auto pairs_per_scale = static_cast<std::size_t>(
      std::ceil(params.pairs_per_point * static_cast<double>(model.pair_points.size()) / scales));
  for (int scale = 0; scale < scales; ++scale) {
    if (absl::Status status = enter(TrainStage::kVectorPairs, 0.5 + 0.4 * scale / scales); !status.ok()) return status;
    select_pairs(vector_pairs(model.pair_points, params.pair_lengths[scale], params.relative_length_tolerance,
                              model.diameter, scale, control),
                 pair_masks, pairs_per_scale, control, model);
  }

  if (absl::Status status = enter(TrainStage::kSymmetry, 0.9); !status.ok()) return status;
  SelfSimilarity self = find_self_similarity(dense, model.surface, model.diameter, control);
  model.symmetry = std::move(self.symmetry);
  model.similar_poses = std::move(self.similar);
  add_telling_points(dense, extent.area / static_cast<double>(dense.size()), control, model);
  model.telling_visibility =
      visibility(dense, model.telling_points, viewpoints, kRelativeCell * model.diameter, control);
  if (absl::Status status = control.status(); !status.ok()) return status;
  derive(model, control);
  if (absl::Status status = control.status(); !status.ok()) return status;
  return model;
}

}  // namespace binpose

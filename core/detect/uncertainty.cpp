#include "core/detect/uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/detect/refine.h"

namespace binpose {
namespace {

/// A direction is free when the mean surface point resists a motion along it by less than this share of what a point
/// could, and the outline by less than this part of a point. Noise of the normals and a mesh's facets make 0.0005 to
/// 0.0015 for turns about an axis of revolution; the six sides of a bolt's head make 0.0025.
constexpr double kFreeShare = 0.002;
constexpr double kFreeOutline = 0.3;
/// Covariances stay finite: at least so much of a point resists.
constexpr double kLeastResistance = 1e-3;

}  // namespace

Uncertainty uncertainty_of(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                           const VerifyOptions& options, double residual) {
  const Information information = information_of(map, model, T_view_model, 2 * options.tolerance);
  const double radius = 0.5 * model.diameter;
  Twist scale;  // of a motion about the centre whose entries are all lengths
  scale << 1, 1, 1, 1 / radius, 1 / radius, 1 / radius;
  const auto scaled = [&](const Matrix6d& A) -> Matrix6d { return scale.asDiagonal() * A * scale.asDiagonal(); };
  const Matrix6d surface = scaled(information.surface), outline = scaled(information.outline);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> modes(surface + outline);
  Uncertainty uncertainty;
  const double sigma = std::max(residual, static_cast<double>(map.noise));
  for (int i = 0; i < 6; ++i) {
    const Twist mode = modes.eigenvectors().col(i);
    const Twist motion = scale.asDiagonal() * mode;
    uncertainty.covariance +=
        sigma * sigma / std::max(kLeastResistance, modes.eigenvalues()[i]) * motion * motion.transpose();
    const bool surface_holds = mode.dot(surface * mode) >= kFreeShare * information.surface_count;
    const bool outline_holds = mode.dot(outline * mode) >= kFreeOutline;
    if (!surface_holds && !outline_holds) uncertainty.free_directions.push_back(motion);
  }
  return uncertainty;
}

}  // namespace binpose

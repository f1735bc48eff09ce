#include "core/detect/rivals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/detect/places.h"
#include "core/detect/telling.h"

namespace binpose {
namespace {

/// What the scan says to a visible point of a pose.
struct Claim {
  int pixel;
  float weight;  ///< see telling_weights(), never 0
};

BINPOSE_VECTORISED
std::vector<Claim> claims_of(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                             const VerifyOptions& options) {
  const std::span<const std::uint16_t> visible = visible_points(model, T_view_model);
  std::vector<Claim> claims;
  claims.reserve(visible.size());
  PointBlock block;
  for (std::size_t first = 0; first < visible.size(); first += kLanes) {
    block.load(model.surface, visible.subspan(first), T_view_model);
    block.look_up(map);
    const Lanes weights = telling_weights(block, kSteepest, options.tolerance, static_cast<float>(model.diameter));
    for (int i = 0; i < kLanes; ++i) {
      if (weights[i] != 0) claims.push_back({block.pixel[i], weights[i]});
    }
  }
  return claims;
}

float explained_by(std::span<const Claim> claims) {
  float sum = 0;
  for (const Claim& claim : claims) sum += std::max(0.0F, claim.weight);
  return sum;
}

/// The greater prevails.
enum class Mark : std::uint8_t { kNothing, kWrong, kRight };

Mark mark_of(const Claim& claim) { return claim.weight > 0 ? Mark::kRight : Mark::kWrong; }

/// Where the claims of a pose are right and where wrong: cells as large as points lie apart, in a window of the image.
class ClaimMap {
 public:
  /// Empty; the window holds all of `claims` with two cells around them.
  ClaimMap(int image_width, int cell, std::span<const Claim> claims) : image_width_(image_width), cell_(cell) {
    if (claims.empty()) return;
    Eigen::Array2i low = cell_of(claims.front()), high = low;
    for (const Claim& claim : claims) {
      low = low.min(cell_of(claim));
      high = high.max(cell_of(claim));
    }
    first_ = low - 2;
    size_ = high - low + 5;
    marks_.resize(size_.prod());
  }

  /// In place of what was marked. Each claim marks the cells around it; near both, the pose is right.
  void mark(std::span<const Claim> claims) {
    std::fill(marks_.begin(), marks_.end(), Mark::kNothing);
    for (const Claim& claim : claims) {
      const Eigen::Array2i middle = cell_of(claim) - first_;
      if ((middle < 1).any() || (middle >= size_ - 1).any()) continue;
      const Mark mark = mark_of(claim);
      for (int row = middle.y() - 1; row <= middle.y() + 1; ++row) {
        Mark* const cells = &marks_[row * size_.x() + middle.x() - 1];
        for (int k = 0; k < 3; ++k) cells[k] = std::max(cells[k], mark);
      }
    }
  }

  Mark at(const Claim& claim) const {
    const Eigen::Array2i c = cell_of(claim) - first_;
    return (c >= 0).all() && (c < size_).all() ? marks_[c.y() * size_.x() + c.x()] : Mark::kNothing;
  }

 private:
  Eigen::Array2i cell_of(const Claim& claim) const {
    return {claim.pixel % image_width_ / cell_, claim.pixel / image_width_ / cell_};
  }

  int image_width_, cell_;
  Eigen::Array2i first_ = {0, 0}, size_ = {0, 0};
  std::vector<Mark> marks_;
};

/// What the scan says for a pose, against another.
struct Comparison {
  float alone = 0;   ///< where it says something else of the other
  float common = 0;  ///< where both explain it
};

Comparison compare(std::span<const Claim> claims, const ClaimMap& other) {
  Comparison sum;
  for (const Claim& claim : claims) {
    const Mark mark = other.at(claim);
    if (mark != mark_of(claim)) {
      sum.alone += claim.weight;
    } else if (mark == Mark::kRight) {
      sum.common += claim.weight;
    }
  }
  return sum;
}

/// Of `others` those in the same place, without the pose itself, its similar ones and doubles.
std::vector<Eigen::Isometry3f> contenders(const Model& model, const Eigen::Isometry3f& T_view_model,
                                          std::span<const Eigen::Isometry3f> others) {
  const Eigen::Vector3f centre = model.centre.cast<float>(), place = T_view_model * centre;
  std::vector<Eigen::Isometry3f> known = {T_view_model};
  for (const Pose& T_model_model : model.similar_poses) known.push_back(T_view_model * T_model_model.cast<float>());
  const auto judged_already = std::ssize(known);
  for (const Eigen::Isometry3f& other : others) {
    if ((other * centre - place).norm() > kSamePlace * static_cast<float>(model.diameter)) continue;
    const bool is_known = std::any_of(known.begin(), known.end(),
                                      [&](const Eigen::Isometry3f& pose) { return same_pose(model, pose, other); });
    if (!is_known) known.push_back(other);
  }
  known.erase(known.begin(), known.begin() + judged_already);
  return known;
}

}  // namespace

Rivalry weigh_rivals(const DepthMap& map, const Model& model, const Eigen::Isometry3f& T_view_model,
                     std::span<const Eigen::Isometry3f> others, const VerifyOptions& options) {
  Rivalry rivalry;
  const std::vector<Eigen::Isometry3f> against = contenders(model, T_view_model, others);
  if (against.empty()) return rivalry;
  const float spacing = static_cast<float>(kRelativeSurfaceSpacing * model.diameter) / map.pixel_size;
  const std::vector<Claim> own = claims_of(map, model, T_view_model, options);
  ClaimMap own_map(map.width, std::max(1, static_cast<int>(std::lround(spacing))), own), other_map = own_map;
  own_map.mark(own);
  const float enough = kSameSurface * explained_by(own);
  for (const Eigen::Isometry3f& other : against) {
    const std::vector<Claim> theirs = claims_of(map, model, other, options);
    other_map.mark(theirs);
    const Comparison ours = compare(own, other_map);
    if (ours.common < enough) continue;
    const float likelihood = likelihood_ratio(compare(theirs, own_map).alone - ours.alone, spacing);
    if (likelihood <= kRuledOut) continue;
    rivalry.odds += likelihood;
    rivalry.rivals.push_back(other);
  }
  return rivalry;
}

}  // namespace binpose

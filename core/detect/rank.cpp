#include "core/detect/rank.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "core/parallel.h"

namespace binpose {
namespace {

constexpr int kNobody = -1;
constexpr float kInFront = 0.02F;  // diameters
constexpr double kTrace = 0.02;    // of the visible surface

/// Marks the pixels that a pose explains: those around each visible model point that measure the same surface.
void own_pixels(const DepthMap& map, const Model& model, const Candidate& candidate, float tolerance, int index,
                std::vector<int>& owner) {
  for (const std::uint16_t point : visible_points(model, candidate.T_view_model)) {
    const Eigen::Vector3f p = candidate.T_view_model * model.surface[point].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0) continue;
    const Eigen::Vector3f normal = candidate.T_view_model.linear() * model.surface[point].normal;
    const int u = pixel % map.width, v = pixel / map.width;
    for (int row = std::max(0, v - 1); row <= std::min(map.height - 1, v + 1); ++row) {
      for (int column = std::max(0, u - 1); column <= std::min(map.width - 1, u + 1); ++column) {
        const int i = row * map.width + column;
        if (map.measured(i) && std::abs(normal.dot(map.pixels[i].position - p)) <= tolerance) owner[i] = index;
      }
    }
  }
}

/// The owners of what lies in front of a pose's surface, where they hide more than a trace of it.
std::vector<int> find_occluders(const DepthMap& map, const Model& model, const Candidate& candidate, int index,
                                const std::vector<int>& owner) {
  std::map<int, int> hidden_by;
  const std::vector<std::uint16_t>& visible = visible_points(model, candidate.T_view_model);
  for (const std::uint16_t i : visible) {
    const Eigen::Vector3f p = candidate.T_view_model * model.surface[i].position;
    const int pixel = p.z() > 0 ? map.pixel_of(p) : -1;
    if (pixel < 0 || owner[pixel] == kNobody || owner[pixel] == index) continue;
    const bool hidden = map.pixels[pixel].position.z() < p.z() - kInFront * static_cast<float>(model.diameter);
    if (hidden) ++hidden_by[owner[pixel]];
  }
  std::vector<int> occluders;
  for (const auto& [other, count] : hidden_by) {
    if (count > kTrace * static_cast<double>(visible.size())) occluders.push_back(other);
  }
  return occluders;
}

/// Candidates in line for acceptance, best first.
class Line {
 public:
  Line(const DepthMap& map, std::span<const Model* const> models, std::vector<Candidate> candidates,
       const RankOptions& options, const RunControl& control)
      : map_(map),
        models_(models),
        options_(options),
        control_(control),
        candidates_(std::move(candidates)),
        variants_(candidates_.size()),
        order_(candidates_.size()),
        is_present_(models.size(), false),
        owner_(map.pixels.size(), kNobody) {
    std::stable_sort(candidates_.begin(), candidates_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score() > b.score(); });
    std::iota(order_.begin(), order_.end(), 0);
    choose_variants();
  }

  /// The next that score at least `min_score`, at most `limit` of them. Those of a model that none of was accepted yet,
  /// and that score less than `presence_score`, are passed over.
  std::vector<Candidate> accept(double min_score, double presence_score, std::size_t limit) {
    std::vector<Candidate> accepted;
    while (next_ < order_.size() && accepted.size() < limit && candidates_[order_[next_]].score() >= min_score &&
           !control_.stop.stop_requested()) {
      if (!stands_firm()) continue;
      const Candidate& candidate = candidates_[order_[next_]];
      if (!is_present_[candidate.model_index] && candidate.score() < presence_score) {
        doubtful_.push_back(order_[next_++]);
        continue;
      }
      is_present_[candidate.model_index] = true;
      ++next_;
      own_pixels(map_, *models_[candidate.model_index], candidate,
                 options_.verification[candidate.model_index].tolerance, accepted_count_++, owner_);
      accepted.push_back(candidate);
    }
    return accepted;
  }

  /// Brings those that were passed over back to the front. Returns the best one's score, 0 if there are none.
  float take_back_doubtful() {
    const float best = doubtful_.empty() ? 0 : candidates_[doubtful_.front()].score();
    order_.insert(order_.begin() + static_cast<std::ptrdiff_t>(next_), doubtful_.begin(), doubtful_.end());
    doubtful_.clear();
    return best;
  }

  /// Per pixel: the running number of the accepted pose that explains it.
  const std::vector<int>& owner() const { return owner_; }

 private:
  VariantChoice variant_of(const Candidate& candidate) const {
    return choose_variant(
        map_, *models_[candidate.model_index], candidate.T_view_model, options_.verification[candidate.model_index],
        [&](const Eigen::Isometry3f& T_view_model) { return options_.allowed(candidate.model_index, T_view_model); });
  }

  /// Of all that will stand first, in parallel: the choice does not depend on what others own.
  void choose_variants() {
    parallel_for(static_cast<int>(candidates_.size()), control_.threads, [&](int i) {
      if (candidates_[i].score() < options_.min_score || control_.stop.stop_requested()) return;
      variants_[i] = variant_of(candidates_[i]);
    });
  }

  /// Judges the first in line anew; sends it back to its place if it lost pixels to a better one.
  bool stands_firm() {
    const int i = order_[next_];
    Candidate& candidate = candidates_[i];
    const Model& model = *models_[candidate.model_index];
    const VerifyOptions& options = options_.verification[candidate.model_index];
    const float before = candidate.score();
    if (!candidate.has_variant) {
      VariantChoice choice = variants_[i] ? *std::move(variants_[i]) : variant_of(candidate);
      candidate.has_variant = true;
      candidate.T_view_model = choice.T_view_model;
      candidate.confidence = choice.confidence;
      candidate.rivals = std::move(choice.rivals);
    }
    candidate.evidence = verify(map_, model, candidate.T_view_model, options, &owner_);
    if (candidate.score() >= before) return true;
    const auto first = order_.begin() + static_cast<std::ptrdiff_t>(next_);
    std::rotate(first, first + 1, std::upper_bound(first + 1, order_.end(), i, [&](int a, int b) {
                  return candidates_[a].score() > candidates_[b].score();
                }));
    return false;
  }

  const DepthMap& map_;
  const std::span<const Model* const> models_;
  const RankOptions& options_;
  const RunControl& control_;
  std::vector<Candidate> candidates_;
  std::vector<std::optional<VariantChoice>> variants_;  // of each candidate, where chosen ahead
  std::vector<int> order_;                              // of the candidates
  std::size_t next_ = 0;
  std::vector<int> doubtful_;     // passed over, best first
  std::vector<bool> is_present_;  // per model: one was accepted
  int accepted_count_ = 0;
  std::vector<int> owner_;
};

}  // namespace

Ranking rank(const DepthMap& map, std::span<const Model* const> models, std::vector<Candidate> candidates,
             const RankOptions& options, const RunControl& control) {
  Line line(map, models, std::move(candidates), options, control);
  Ranking ranking;
  ranking.accepted = line.accept(options.min_score, options.presence_score, std::numeric_limits<std::size_t>::max());
  parallel_for(static_cast<int>(ranking.accepted.size()), control.threads, [&](int i) {
    Candidate& candidate = ranking.accepted[i];
    candidate.occluded_by = find_occluders(map, *models[candidate.model_index], candidate, i, line.owner());
  });
  ranking.best_doubtful = line.take_back_doubtful();
  constexpr double kAnything = 1e-6;  // a pose for which nothing speaks is none
  ranking.rejected = line.accept(kAnything, 0, static_cast<std::size_t>(options.max_rejected));
  return ranking;
}

}  // namespace binpose

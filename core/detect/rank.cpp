#include "core/detect/rank.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "core/detect/rivals.h"
#include "core/parallel.h"

namespace binpose {
namespace {

constexpr int kNobody = -1;
constexpr float kInFront = 0.02F;  // diameters
constexpr double kTrace = 0.02;    // of the visible surface
/// Share of a pose's score that another must have to be worth comparing.
constexpr float kRivalShare = 0.6F;

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
        if (owner[i] == index || !map.measured(i)) continue;
        if (std::abs(normal.dot(map.pixels[i].position - p)) <= tolerance) owner[i] = index;
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
        first_(std::move(candidates)),
        variants_(first_.size()),
        rivalries_(first_.size()),
        is_absent_(models.size(), false) {
    std::stable_sort(first_.begin(), first_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score() > b.score(); });
    choose_variants();
    start_anew();
  }

  /// The next that score at least `min_score`, at most `limit` of them. Those of absent models are passed over.
  std::vector<Candidate> accept(double min_score, std::size_t limit) {
    std::vector<Candidate> accepted;
    while (next_ < order_.size() && accepted.size() < limit && candidates_[order_[next_]].score() >= min_score &&
           !control_.stop.stop_requested()) {
      if (is_absent_[candidates_[order_[next_]].model_index]) {
        passed_over_.push_back(order_[next_++]);
        continue;
      }
      if (!stands_firm()) continue;
      const Candidate& candidate = candidates_[order_[next_++]];
      own_pixels(map_, *models_[candidate.model_index], candidate,
                 options_.verification[candidate.model_index].tolerance, accepted_count_++, owner_);
      accepted.push_back(candidate);
    }
    return accepted;
  }

  /// Nothing is accepted any more, and nothing will be of these models besides those that were absent before.
  void start_without(const std::vector<int>& absent) {
    for (const int model : absent) is_absent_[model] = true;
    start_anew();
  }

  /// Brings those that were passed over back to the front.
  void take_back() {
    order_.insert(order_.begin() + static_cast<std::ptrdiff_t>(next_), passed_over_.begin(), passed_over_.end());
    passed_over_.clear();
    std::fill(is_absent_.begin(), is_absent_.end(), false);
  }

  /// Per pixel: the running number of the accepted pose that explains it.
  const std::vector<int>& owner() const { return owner_; }

 private:
  void start_anew() {
    candidates_ = first_;
    order_.resize(candidates_.size());
    std::iota(order_.begin(), order_.end(), 0);
    next_ = 0;
    passed_over_.clear();
    accepted_count_ = 0;
    owner_.assign(map_.pixels.size(), kNobody);
  }

  VariantChoice variant_of(const Candidate& candidate) const {
    return choose_variant(
        map_, *models_[candidate.model_index], candidate.T_view_model, options_.verification[candidate.model_index],
        [&](const Eigen::Isometry3f& T_view_model) { return options_.allowed(candidate.model_index, T_view_model); });
  }

  /// Of all that will stand first, in parallel: the choice does not depend on what others own.
  void choose_variants() {
    parallel_for(static_cast<int>(first_.size()), control_.threads, [&](int i) {
      if (first_[i].score() < options_.min_score || control_.stop.stop_requested()) return;
      variants_[i] = variant_of(first_[i]);
    });
  }

  /// Compares a candidate with all that are nearly as good; others' pixels don't matter.
  Rivalry rivalry_of(const Candidate& candidate) const {
    std::vector<Eigen::Isometry3f> others;
    for (const Candidate& other : first_) {
      if (other.model_index == candidate.model_index &&
          other.evidence.score() >= kRivalShare * candidate.evidence.score()) {
        others.push_back(other.T_view_model);
      }
    }
    return weigh_rivals(map_, *models_[candidate.model_index], candidate.T_view_model, others,
                        options_.verification[candidate.model_index]);
  }

  /// Judges the first in line anew; sends it back to its place if it lost pixels to a better one or is less sure
  /// than it seemed.
  bool stands_firm() {
    const int i = order_[next_];
    Candidate& candidate = candidates_[i];
    const Model& model = *models_[candidate.model_index];
    const VerifyOptions& options = options_.verification[candidate.model_index];
    const float before = candidate.score();
    if (!variants_[i]) variants_[i] = variant_of(first_[i]);
    candidate.T_view_model = variants_[i]->T_view_model;
    candidate.confidence = variants_[i]->confidence;
    candidate.rivals = variants_[i]->rivals;
    candidate.evidence = verify(map_, model, candidate.T_view_model, options, &owner_);
    // Few get so far: the doubles have lost their pixels.
    if (!rivalries_[i] && candidate.score() >= before) rivalries_[i] = rivalry_of(candidate);
    if (rivalries_[i]) {
      candidate.confidence = 1 / (1 / candidate.confidence + rivalries_[i]->odds);
      candidate.rivals.insert(candidate.rivals.end(), rivalries_[i]->rivals.begin(), rivalries_[i]->rivals.end());
    }
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
  std::vector<Candidate> first_;                        // as they came, best first
  std::vector<std::optional<VariantChoice>> variants_;  // of each candidate, where chosen already
  std::vector<std::optional<Rivalry>> rivalries_;       // the same
  std::vector<bool> is_absent_;                         // per model: none of it is accepted
  std::vector<Candidate> candidates_;                   // as judged so far
  std::vector<int> order_;                              // of the candidates
  std::size_t next_ = 0;
  std::vector<int> passed_over_;  // best first
  int accepted_count_ = 0;
  std::vector<int> owner_;
};

/// The best presence of each model's candidates, -1 where there are none.
std::vector<float> presence_by_model(std::span<const Candidate> candidates, std::size_t model_count) {
  std::vector<float> presence(model_count, -1);
  for (const Candidate& candidate : candidates) {
    float& best = presence[candidate.model_index];
    best = std::max(best, candidate.presence());
  }
  return presence;
}

/// Accepts candidates of the models that are there. What an absent model's poses took from others is theirs again.
std::vector<Candidate> accept_present(Line& line, std::size_t model_count, const RankOptions& options,
                                      float& best_doubtful) {
  while (true) {
    std::vector<Candidate> accepted = line.accept(options.min_score, std::numeric_limits<std::size_t>::max());
    const std::vector<float> presence = presence_by_model(accepted, model_count);
    std::vector<int> absent;
    for (int m = 0; m < static_cast<int>(model_count); ++m) {
      if (presence[m] < 0 || presence[m] >= options.presence_score) continue;
      best_doubtful = std::max(best_doubtful, presence[m]);
      absent.push_back(m);
    }
    if (absent.empty()) return accepted;
    line.start_without(absent);
  }
}

}  // namespace

Ranking rank(const DepthMap& map, std::span<const Model* const> models, std::vector<Candidate> candidates,
             const RankOptions& options, const RunControl& control) {
  Line line(map, models, std::move(candidates), options, control);
  Ranking ranking;
  ranking.accepted = accept_present(line, models.size(), options, ranking.best_doubtful);
  parallel_for(static_cast<int>(ranking.accepted.size()), control.threads, [&](int i) {
    Candidate& candidate = ranking.accepted[i];
    candidate.occluded_by = find_occluders(map, *models[candidate.model_index], candidate, i, line.owner());
  });
  line.take_back();
  constexpr double kAnything = 1e-6;  // a pose for which nothing speaks is none
  ranking.rejected = line.accept(kAnything, static_cast<std::size_t>(options.max_rejected));
  return ranking;
}

}  // namespace binpose

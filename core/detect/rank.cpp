#include "core/detect/rank.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "core/detect/ownership.h"
#include "core/detect/places.h"
#include "core/detect/rivals.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// Share of a pose's score that another must have to be worth comparing.
constexpr float kRivalShare = 0.6F;

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
        pixels_(first_.size()),
        is_absent_(models.size(), false) {
    std::stable_sort(first_.begin(), first_.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score() > b.score(); });
    if (control.threads > 1) look_ahead();
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
      const int i = order_[next_++];
      if (pixels_[i].empty()) pixels_[i] = pixels_of(i);
      for (const int pixel : pixels_[i]) owner_[pixel] = static_cast<int>(accepted_boxes_.size());
      accepted_boxes_.push_back(box_in_image(candidates_[i]));
      accepted.push_back(candidates_[i]);
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
    verified_after_.assign(candidates_.size(), std::nullopt);
    order_.resize(candidates_.size());
    std::iota(order_.begin(), order_.end(), 0);
    next_ = 0;
    passed_over_.clear();
    accepted_boxes_.clear();
    owner_.assign(map_.pixels.size(), kNobody);
  }

  /// Does on all threads what does not depend on others' pixels: for all that will come to the front, and what only
  /// those need that are accepted, for the best of each place.
  void look_ahead() {
    std::vector<bool> is_best;
    while (is_best.size() < first_.size() && first_[is_best.size()].score() >= options_.min_score) {
      is_best.push_back(is_best_of_place(is_best));
    }
    parallel_for(static_cast<int>(is_best.size()), control_.threads, [&](int i) {
      if (control_.stop.stop_requested()) return;
      variants_[i] = variant_of(first_[i]);
      if (!is_best[i]) return;
      rivalries_[i] = rivalry_of(i);
      pixels_[i] = pixels_of(i);
    });
  }

  /// Whether the candidate that follows those told of is far from the best among them.
  bool is_best_of_place(const std::vector<bool>& is_best) const {
    const Candidate& candidate = first_[is_best.size()];
    const Model& model = *models_[candidate.model_index];
    const Eigen::Vector3f centre = model.centre.cast<float>(), place = candidate.T_view_model * centre;
    for (std::size_t i = 0; i < is_best.size(); ++i) {
      const float distance = (first_[i].T_view_model * centre - place).norm();
      const bool is_near = distance < kNeighbourhood * static_cast<float>(model.diameter);
      if (is_best[i] && first_[i].model_index == candidate.model_index && is_near) return false;
    }
    return true;
  }

  Eigen::AlignedBox2i box_in_image(const Candidate& candidate) const {
    return image_box(map_, *models_[candidate.model_index], candidate.T_view_model);
  }

  VariantChoice variant_of(const Candidate& candidate) const {
    return choose_variant(
        map_, *models_[candidate.model_index], candidate.T_view_model, options_.verification[candidate.model_index],
        [&](const Eigen::Isometry3f& T_view_model) { return options_.allowed(candidate.model_index, T_view_model); });
  }

  /// Compares a candidate whose variant is chosen with all that are nearly as good.
  Rivalry rivalry_of(int i) const {
    const Candidate& candidate = first_[i];
    std::vector<Eigen::Isometry3f> others;
    for (const Candidate& other : first_) {
      if (other.model_index == candidate.model_index &&
          other.evidence.score() >= kRivalShare * candidate.evidence.score()) {
        others.push_back(other.T_view_model);
      }
    }
    return weigh_rivals(map_, *models_[candidate.model_index], variants_[i]->T_view_model, others,
                        options_.verification[candidate.model_index]);
  }

  /// What a candidate whose variant is chosen explains.
  std::vector<int> pixels_of(int i) const {
    const int m = first_[i].model_index;
    return explained_pixels(map_, *models_[m], variants_[i]->T_view_model, options_.verification[m].tolerance);
  }

  /// Judges a candidate anew, without the pixels of those accepted.
  void judge(int i) {
    Candidate& candidate = candidates_[i];
    const float before = candidate.score();
    if (!variants_[i]) variants_[i] = variant_of(first_[i]);
    candidate.T_view_model = variants_[i]->T_view_model;
    candidate.confidence = variants_[i]->confidence;
    candidate.rivals = variants_[i]->rivals;
    if (!is_verified(i)) {
      candidate.evidence = verify(map_, *models_[candidate.model_index], candidate.T_view_model,
                                  options_.verification[candidate.model_index], &owner_);
      verified_after_[i] = accepted_boxes_.size();
    }
    // Few get so far: the doubles have lost their pixels.
    if (!rivalries_[i] && candidate.score() >= before) rivalries_[i] = rivalry_of(i);
    if (rivalries_[i]) {
      candidate.confidence = 1 / (1 / candidate.confidence + rivalries_[i]->odds);
      candidate.rivals.insert(candidate.rivals.end(), rivalries_[i]->rivals.begin(), rivalries_[i]->rivals.end());
    }
  }

  /// Whether a candidate was verified and nothing was accepted since that could own a pixel of its.
  bool is_verified(int i) const {
    if (!verified_after_[i]) return false;
    const Eigen::AlignedBox2i box = box_in_image(candidates_[i]);
    return std::none_of(accepted_boxes_.begin() + static_cast<std::ptrdiff_t>(*verified_after_[i]),
                        accepted_boxes_.end(), [&](const Eigen::AlignedBox2i& other) { return box.intersects(other); });
  }

  /// Judges the first in line; sends it back to its place if it lost pixels to a better one or is less sure than it
  /// seemed.
  bool stands_firm() {
    const int i = order_[next_];
    const float before = candidates_[i].score();
    judge(i);
    if (candidates_[i].score() >= before) return true;
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
  std::vector<Candidate> first_;                            // as they came, best first
  std::vector<std::optional<VariantChoice>> variants_;      // of each candidate, where chosen already
  std::vector<std::optional<Rivalry>> rivalries_;           // the same
  std::vector<std::vector<int>> pixels_;                    // that each explains; empty where not looked up yet
  std::vector<bool> is_absent_;                             // per model: none of it is accepted
  std::vector<Candidate> candidates_;                       // as judged so far
  std::vector<std::optional<std::size_t>> verified_after_;  // of each candidate: so many were accepted
  std::vector<int> order_;                                  // of the candidates
  std::size_t next_ = 0;
  std::vector<int> passed_over_;  // best first
  std::vector<Eigen::AlignedBox2i> accepted_boxes_;
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

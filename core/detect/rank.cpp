#include "core/detect/rank.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>

#include "core/detect/ownership.h"
#include "core/detect/rivals.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// Share of a pose's score that another must have to be worth comparing.
constexpr float kRivalShare = 0.6F;
/// Candidates per thread among which some to judge beside the first are looked for.
constexpr std::size_t kAhead = 8;

/// What a candidate is worth beside those accepted before.
struct Judgement {
  Candidate candidate;
  Eigen::AlignedBox2i box;     // of the pixels that it was judged by
  std::size_t accepted_count;  // of those before
};

Eigen::AlignedBox3f box_of(const std::vector<SurfacePoint>& surface) {
  Eigen::AlignedBox3f box;
  for (const SurfacePoint& point : surface) box.extend(point.position);
  return box;
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
    for (const Model* model : models) surface_boxes_.push_back(box_of(model->surface));
    for (const Candidate& candidate : first_) boxes_.push_back(box_in_image(candidate));
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
      if (!is_judged(order_[next_])) judge_ahead(min_score);
      if (!stands_firm()) continue;
      const Candidate& candidate = candidates_[order_[next_++]];
      own_pixels(map_, *models_[candidate.model_index], candidate,
                 options_.verification[candidate.model_index].tolerance, static_cast<int>(accepted_boxes_.size()),
                 owner_);
      accepted_boxes_.push_back(box_in_image(candidate));
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
    judgements_.assign(candidates_.size(), std::nullopt);
    order_.resize(candidates_.size());
    std::iota(order_.begin(), order_.end(), 0);
    next_ = 0;
    passed_over_.clear();
    accepted_boxes_.clear();
    owner_.assign(map_.pixels.size(), kNobody);
  }

  Eigen::AlignedBox2i box_in_image(const Candidate& candidate) const {
    return image_box(map_, surface_boxes_[candidate.model_index], candidate.T_view_model);
  }

  VariantChoice variant_of(const Candidate& candidate) const {
    return choose_variant(
        map_, *models_[candidate.model_index], candidate.T_view_model, options_.verification[candidate.model_index],
        [&](const Eigen::Isometry3f& T_view_model) { return options_.allowed(candidate.model_index, T_view_model); });
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

  /// Judges a candidate anew, without the pixels of those accepted. May run beside the judging of others.
  Judgement judge(int i) {
    Candidate candidate = candidates_[i];
    const float before = candidate.score();
    if (!variants_[i]) variants_[i] = variant_of(first_[i]);
    candidate.T_view_model = variants_[i]->T_view_model;
    candidate.confidence = variants_[i]->confidence;
    candidate.rivals = variants_[i]->rivals;
    candidate.evidence = verify(map_, *models_[candidate.model_index], candidate.T_view_model,
                                options_.verification[candidate.model_index], &owner_);
    // Few get so far: the doubles have lost their pixels.
    if (!rivalries_[i] && candidate.score() >= before) rivalries_[i] = rivalry_of(candidate);
    if (rivalries_[i]) {
      candidate.confidence = 1 / (1 / candidate.confidence + rivalries_[i]->odds);
      candidate.rivals.insert(candidate.rivals.end(), rivalries_[i]->rivals.begin(), rivalries_[i]->rivals.end());
    }
    const Eigen::AlignedBox2i box = box_in_image(candidate);
    return {std::move(candidate), box, accepted_boxes_.size()};
  }

  /// Whether a candidate was judged and nothing was accepted since that could own a pixel that it was judged by.
  bool is_judged(int i) const {
    const std::optional<Judgement>& judgement = judgements_[i];
    return judgement && std::all_of(accepted_boxes_.begin() + static_cast<std::ptrdiff_t>(judgement->accepted_count),
                                    accepted_boxes_.end(),
                                    [&](const Eigen::AlignedBox2i& box) { return !box.intersects(judgement->box); });
  }

  /// Judges the first in line, and on other threads some that come soon and have pixels of their own.
  void judge_ahead(double min_score) {
    const auto threads = static_cast<std::size_t>(control_.threads);
    const std::size_t last = std::min(order_.size(), next_ + kAhead * threads);
    std::vector<int> batch = {order_[next_]};
    for (std::size_t k = next_ + 1; k < last && batch.size() < threads; ++k) {
      const int i = order_[k];
      if (candidates_[i].score() < min_score) break;
      const bool alone =
          std::none_of(batch.begin(), batch.end(), [&](int j) { return boxes_[i].intersects(boxes_[j]); });
      if (alone && !is_absent_[candidates_[i].model_index] && !is_judged(i)) batch.push_back(i);
    }
    parallel_for(static_cast<int>(batch.size()), control_.threads,
                 [&](int k) { judgements_[batch[k]] = judge(batch[k]); });
  }

  /// Takes the judgement of the first in line; sends it back to its place if it lost pixels to a better one or is less
  /// sure than it seemed.
  bool stands_firm() {
    const int i = order_[next_];
    const float before = candidates_[i].score();
    candidates_[i] = std::move(judgements_[i]->candidate);
    judgements_[i].reset();
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
  std::vector<Eigen::AlignedBox3f> surface_boxes_;      // of each model
  std::vector<Candidate> first_;                        // as they came, best first
  std::vector<Eigen::AlignedBox2i> boxes_;              // of each candidate as it came
  std::vector<std::optional<VariantChoice>> variants_;  // of each candidate, where chosen already
  std::vector<std::optional<Rivalry>> rivalries_;       // the same
  std::vector<bool> is_absent_;                         // per model: none of it is accepted
  std::vector<Candidate> candidates_;                   // as judged so far
  std::vector<std::optional<Judgement>> judgements_;    // not taken yet
  std::vector<int> order_;                              // of the candidates
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

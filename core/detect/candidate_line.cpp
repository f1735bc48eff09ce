#include "core/detect/candidate_line.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/detect/ownership.h"
#include "core/detect/places.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// Share of a pose's score that another must have to be worth comparing.
constexpr float kRivalShare = 0.6F;

}  // namespace

CandidateLine::CandidateLine(const DepthMap& map, std::span<const Model* const> models,
                             std::vector<Candidate> candidates, const RankOptions& options, const RunControl& control)
    : map_(map),
      models_(models),
      options_(options),
      control_(control),
      first_(std::move(candidates)),
      variants_(first_.size()),
      rivalries_(first_.size()),
      pixels_(first_.size()),
      least_presence_(models.size(), -INFINITY) {
  for (Candidate& candidate : first_) candidate.accept_rivals = options.accept_ambiguous;
  std::stable_sort(first_.begin(), first_.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score() > b.score(); });
  if (control.threads > 1) look_ahead();
  start_anew();
}

std::vector<Candidate> CandidateLine::accept(double min_score, std::size_t limit) {
  std::vector<Candidate> accepted;
  while (next_ < order_.size() && accepted.size() < limit && candidates_[order_[next_]].score() >= min_score &&
         !control_.stop.stop_requested()) {
    if (!proves_too_little(order_[next_]) && !stands_firm()) continue;
    const int i = order_[next_++];
    if (proves_too_little(i)) {
      passed_over_.push_back(i);
      continue;
    }
    if (pixels_[i].empty()) pixels_[i] = pixels_of(i);
    for (const int pixel : pixels_[i]) owner_[pixel] = static_cast<int>(accepted_boxes_.size());
    accepted_boxes_.push_back(box_in_image(candidates_[i]));
    accepted.push_back(candidates_[i]);
  }
  return accepted;
}

bool CandidateLine::is_held_back_by_rivals(double min_score) const {
  return std::any_of(order_.begin() + static_cast<std::ptrdiff_t>(next_), order_.end(),
                     [&](int i) { return candidates_[i].evidence.score() >= min_score; });
}

void CandidateLine::accept_rivals() {
  for (Candidate& candidate : candidates_) candidate.accept_rivals = true;
  std::stable_sort(order_.begin() + static_cast<std::ptrdiff_t>(next_), order_.end(),
                   [&](int a, int b) { return candidates_[a].score() > candidates_[b].score(); });
}

bool CandidateLine::ask_of_each(int model_index, float presence) {
  if (presence <= least_presence_[model_index]) return false;
  least_presence_[model_index] = presence;
  return true;
}

void CandidateLine::start_anew() {
  candidates_ = first_;
  verified_after_.assign(candidates_.size(), std::nullopt);
  order_.resize(candidates_.size());
  std::iota(order_.begin(), order_.end(), 0);
  next_ = 0;
  passed_over_.clear();
  accepted_boxes_.clear();
  owner_.assign(map_.pixels.size(), kNobody);
}

void CandidateLine::take_back() {
  order_.insert(order_.begin() + static_cast<std::ptrdiff_t>(next_), passed_over_.begin(), passed_over_.end());
  passed_over_.clear();
  std::fill(least_presence_.begin(), least_presence_.end(), -INFINITY);
}

bool CandidateLine::proves_too_little(int i) const {
  return candidates_[i].presence() < least_presence_[candidates_[i].model_index];
}

void CandidateLine::look_ahead() {
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

bool CandidateLine::is_best_of_place(const std::vector<bool>& is_best) const {
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

Eigen::AlignedBox2i CandidateLine::box_in_image(const Candidate& candidate) const {
  return image_box(map_, *models_[candidate.model_index], candidate.T_view_model);
}

VariantChoice CandidateLine::variant_of(const Candidate& candidate) const {
  return choose_variant(
      map_, *models_[candidate.model_index], candidate.T_view_model, options_.verification[candidate.model_index],
      [&](const Eigen::Isometry3f& T_view_model) { return options_.allowed(candidate.model_index, T_view_model); });
}

Rivalry CandidateLine::rivalry_of(int i) const {
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

std::vector<int> CandidateLine::pixels_of(int i) const {
  const int m = first_[i].model_index;
  return explained_pixels(map_, *models_[m], variants_[i]->T_view_model, options_.verification[m].tolerance);
}

void CandidateLine::judge(int i) {
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

bool CandidateLine::is_verified(int i) const {
  if (!verified_after_[i]) return false;
  const Eigen::AlignedBox2i box = box_in_image(candidates_[i]);
  return std::none_of(accepted_boxes_.begin() + static_cast<std::ptrdiff_t>(*verified_after_[i]), accepted_boxes_.end(),
                      [&](const Eigen::AlignedBox2i& other) { return box.intersects(other); });
}

bool CandidateLine::stands_firm() {
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

}  // namespace binpose

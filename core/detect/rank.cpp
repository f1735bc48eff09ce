#include "core/detect/rank.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/detect/candidate_line.h"
#include "core/detect/ownership.h"
#include "core/parallel.h"

namespace binpose {
namespace {

/// A part is surely there, so that other poses of it need no proof, if one pose's lenient presence is so many times
/// what is asked for.
constexpr float kSure = 1.15F;

/// The best of each model's candidates by a merit, -1 where there are none.
std::vector<float> best_by_model(float (Candidate::*merit)() const, std::span<const Candidate> candidates,
                                 std::size_t model_count) {
  std::vector<float> best(model_count, -1);
  for (const Candidate& candidate : candidates) {
    float& of_model = best[candidate.model_index];
    of_model = std::max(of_model, (candidate.*merit)());
  }
  return best;
}

/// Accepts candidates of the models that are there: all of a model that surely is, else those that each prove it, and
/// none of an absent one. What those had taken that are accepted no more is the others' again.
std::vector<Candidate> accept_present(CandidateLine& line, std::size_t model_count, const RankOptions& options,
                                      float& best_doubtful) {
  const auto enough = static_cast<float>(options.presence_score);
  while (true) {
    std::vector<Candidate> accepted = line.accept(options.min_score, std::numeric_limits<std::size_t>::max());
    const std::vector<float> presence = best_by_model(&Candidate::presence, accepted, model_count);
    const std::vector<float> lenient = best_by_model(&Candidate::lenient_presence, accepted, model_count);
    bool is_changed = false;
    for (int m = 0; m < static_cast<int>(model_count); ++m) {
      const bool is_absent = presence[m] < enough;
      if (presence[m] < 0 || (!is_absent && lenient[m] >= kSure * enough)) continue;
      if (is_absent) best_doubtful = std::max(best_doubtful, presence[m]);
      is_changed |= line.ask_of_each(m, is_absent ? INFINITY : enough);
    }
    if (!is_changed) return accepted;
    line.start_anew();
  }
}

/// Counts the places of parts that are surely there, but in a pose that has too many rivals.
int count_ambiguous(CandidateLine line, const RankOptions& options) {
  line.accept_rivals();
  const std::vector<Candidate> more = line.accept(options.min_score, std::numeric_limits<std::size_t>::max());
  return static_cast<int>(std::count_if(more.begin(), more.end(), [&](const Candidate& candidate) {
    return !candidate.rivals.empty() && candidate.presence() >= static_cast<float>(options.presence_score);
  }));
}

}  // namespace

Ranking rank(const DepthMap& map, std::span<const Model* const> models, std::vector<Candidate> candidates,
             const RankOptions& options, const RunControl& control) {
  CandidateLine line(map, models, std::move(candidates), options, control);
  Ranking ranking;
  ranking.accepted = accept_present(line, models.size(), options, ranking.best_doubtful);
  parallel_for(static_cast<int>(ranking.accepted.size()), control.threads, [&](int i) {
    Candidate& candidate = ranking.accepted[i];
    candidate.occluded_by = find_occluders(map, *models[candidate.model_index], candidate, i, line.owner());
  });
  if (line.is_held_back_by_rivals(options.min_score)) ranking.ambiguous_places = count_ambiguous(line, options);
  line.take_back();
  constexpr double kAnything = 1e-6;  // a pose for which nothing speaks is none
  ranking.rejected = line.accept(kAnything, static_cast<std::size_t>(options.max_rejected));
  return ranking;
}

}  // namespace binpose

#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/detect/rank.h"
#include "core/detect/rivals.h"

namespace binpose {

/// Candidates in line for acceptance, best first. What is accepted owns the pixels that it explains; those behind are
/// judged without these. Refers to all that it is made of but the candidates.
class CandidateLine {
 public:
  CandidateLine(const DepthMap& map, std::span<const Model* const> models, std::vector<Candidate> candidates,
                const RankOptions& options, const RunControl& control);

  /// The next that score at least `min_score`, at most `limit` of them. Those that prove too little are passed over.
  std::vector<Candidate> accept(double min_score, std::size_t limit);

  /// Whether one of those in line would score at least `min_score` if rivals did not matter.
  bool is_held_back_by_rivals(double min_score) const;

  /// From now on rivals do not matter.
  void accept_rivals();

  /// Asks for at least this presence() of each of a model's poses. Returns whether that is more than before.
  bool ask_of_each(int model_index, float presence);

  /// Nothing is accepted any more.
  void start_anew();

  /// Brings those that were passed over back to the front; nothing more is asked of any.
  void take_back();

  /// Per pixel: the running number of the accepted pose that explains it.
  const std::vector<int>& owner() const { return owner_; }

 private:
  bool proves_too_little(int i) const;

  /// Does on all threads what does not depend on others' pixels: for all that will come to the front, and what only
  /// those need that are accepted, for the best of each place.
  void look_ahead();

  /// Whether the candidate that follows those told of is far from the best among them.
  bool is_best_of_place(const std::vector<bool>& is_best) const;

  Eigen::AlignedBox2i box_in_image(const Candidate& candidate) const;

  VariantChoice variant_of(const Candidate& candidate) const;

  /// Compares a candidate whose variant is chosen with all that are nearly as good.
  Rivalry rivalry_of(int i) const;

  /// What a candidate whose variant is chosen explains.
  std::vector<int> pixels_of(int i) const;

  /// Judges a candidate anew, without the pixels of those accepted.
  void judge(int i);

  /// Whether a candidate was verified and nothing was accepted since that could own a pixel of its.
  bool is_verified(int i) const;

  /// Judges the first in line; sends it back to its place if it lost pixels to a better one or is less sure than it
  /// seemed.
  bool stands_firm();

  const DepthMap& map_;
  const std::span<const Model* const> models_;
  const RankOptions& options_;
  const RunControl& control_;
  std::vector<Candidate> first_;                            // as they came, best first
  std::vector<std::optional<VariantChoice>> variants_;      // of each candidate, where chosen already
  std::vector<std::optional<Rivalry>> rivalries_;           // the same
  std::vector<std::vector<int>> pixels_;                    // that each explains; empty where not looked up yet
  std::vector<float> least_presence_;                       // per model: of each pose that is accepted
  std::vector<Candidate> candidates_;                       // as judged so far
  std::vector<std::optional<std::size_t>> verified_after_;  // of each candidate: so many were accepted
  std::vector<int> order_;                                  // of the candidates
  std::size_t next_ = 0;
  std::vector<int> passed_over_;  // best first
  std::vector<Eigen::AlignedBox2i> accepted_boxes_;
  std::vector<int> owner_;
};

}  // namespace binpose

#include "core/detect/vote.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/train/vector_pairs.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

constexpr double kBinMargin = 6 * kDegree;  // that a look-up forgives, see model.cpp

/// A block at a known pose, with what votes are made from.
struct VoteScene {
  Model model = testing::quick_model(testing::l_block());
  Pose T_scene_model = testing::pose(35, {1, 2, 0.5}, {-0.01, 0.01, 0.44});
  DepthMap map;
  ScenePoints points;

  VoteScene() {
    const testing::PlacedMesh bodies[] = {{testing::l_block(), T_scene_model}};
    map = testing::scan_map(bodies, {}, model.diameter);
    points = down_sample(map, 3);
  }
};

PairNormals normals_of(const SurfacePoint& p, const SurfacePoint& q1, const SurfacePoint& q2) {
  return pair_normals(pair_frame(p.position, q1.position, q2.position), p, q1, q2);
}

/// The pose that a correspondence means, and how surely it must be among the votes.
struct Match {
  PoseVote vote;
  bool certain;
};

/// A normal as the table keeps it.
Eigen::Vector3i rounded(const Eigen::Vector3f& normal) {
  return (PairTable::kUnit * normal).array().round().cast<int>();
}

/// All matches of a scene triple by a scan over all pairs of the model, in their order.
void match_linearly(const Model& model, int scale, const SurfacePoint& p, const SurfacePoint& q1,
                    const SurfacePoint& q2, double tolerance, std::vector<Match>& out) {
  const Eigen::Matrix3f M_s = pair_frame(p.position, q1.position, q2.position);
  const PairNormals scene = pair_normals(M_s, p, q1, q2);
  const auto least = static_cast<int>(std::lround(PairTable::kUnit * PairTable::kUnit * std::cos(tolerance)));
  for (std::size_t i = 0; i < model.pairs.size(); ++i) {
    if (model.pairs[i].scale != scale) continue;
    const SurfacePoint &mp = model.pair_points[model.pairs[i].p], &mq1 = model.pair_points[model.pairs[i].q1],
                       &mq2 = model.pair_points[model.pairs[i].q2];
    const PairNormals normals = normals_of(mp, mq1, mq2);
    bool agree = true, near = true;
    for (int k = 0; k < 3; ++k) {
      agree = agree && rounded(normals.col(k)).dot(rounded(scene.col(k))) >= least;
      const double s_m = std::acos(std::clamp(normals(2, k), -1.0F, 1.0F));
      const double s_s = std::acos(std::clamp(scene(2, k), -1.0F, 1.0F));
      near = near && std::abs(s_m - s_s) < kBinMargin;
    }
    if (!agree) continue;
    const Eigen::Matrix3f R = M_s * pair_frame(mp.position, mq1.position, mq2.position).transpose();  // Eq. (8)
    const Eigen::Vector3f centre = p.position + R * (model.centre.cast<float>() - mp.position);
    out.push_back({{centre, model.pair_weights[i], Eigen::Quaternionf(R)}, near});
  }
}

/// All matches from the start points, by a triple loop.
std::vector<Match> all_matches(const VoteScene& scene, std::span<const int> starts, double tolerance,
                               std::uint64_t& triples) {
  const std::vector<SurfacePoint>& points = scene.points.points;
  const double slack = scene.model.params.relative_length_tolerance * scene.model.diameter;
  std::vector<Match> matches;
  for (const int start : starts) {
    for (std::size_t scale = 0; scale < scene.model.params.pair_lengths.size(); ++scale) {
      const double l1 = scene.model.params.pair_lengths[scale].relative_q1 * scene.model.diameter;
      const double l2 = scene.model.params.pair_lengths[scale].relative_q2 * scene.model.diameter;
      for (const SurfacePoint& q1 : points) {
        const Eigen::Vector3f a = q1.position - points[start].position;
        if (std::abs(a.norm() - l1) > slack) continue;
        for (const SurfacePoint& q2 : points) {
          const Eigen::Vector3f b = q2.position - points[start].position;
          if (std::abs(b.norm() - l2) > slack) continue;
          if (std::abs(a.normalized().dot(b.normalized())) > kRightAngleCosine) continue;
          ++triples;
          match_linearly(scene.model, static_cast<int>(scale), points[start], q1, q2, tolerance, matches);
        }
      }
    }
  }
  return matches;
}

bool same(const PoseVote& a, const PoseVote& b) {
  return (a.centre - b.centre).norm() < 1e-5F && a.weight == b.weight &&
         std::abs(a.q_view_model.dot(b.q_view_model)) > 1 - 1e-5F;
}

TEST(Vote, IsGivenForJustTheMatchesOfATripleLoopInOrder) {
  const VoteScene scene;
  std::vector<int> on_block, starts;
  for (const int i : start_points(scene.points, 1)) {
    if (scene.points.points[i].position.z() < 0.48F) on_block.push_back(i);
  }
  for (std::size_t i = 0; i < on_block.size(); i += on_block.size() / 12) starts.push_back(on_block[i]);
  const DetectParams params;
  const Votes votes = vote(scene.points, starts, scene.map, scene.model, params, {});
  std::uint64_t triples = 0;
  const std::vector<Match> matches = all_matches(scene, starts, params.normal_tolerance, triples);
  EXPECT_EQ(votes.scene_pairs, triples);
  std::size_t next = 0, certain = 0;
  for (const Match& match : matches) {
    certain += static_cast<std::size_t>(match.certain);
    if (next < votes.votes.size() && same(match.vote, votes.votes[next])) {
      ++next;
    } else {
      ASSERT_FALSE(match.certain) << "a match that agrees is missing before vote " << next;
    }
  }
  EXPECT_EQ(next, votes.votes.size()) << "this vote has no match that agrees";
  EXPECT_GT(certain, 50u);
}

TEST(Vote, GathersAtTheTruePose) {
  const VoteScene scene;
  const Votes votes = vote(scene.points, start_points(scene.points, 0.5), scene.map, scene.model, DetectParams{}, {});
  const Eigen::Isometry3f truth = testing::in_view(scene.map, scene.T_scene_model);
  const Eigen::Vector3f centre = truth * scene.model.centre.cast<float>();
  const Eigen::Quaternionf rotation(truth.linear());
  const auto near = std::count_if(votes.votes.begin(), votes.votes.end(), [&](const PoseVote& v) {
    return (v.centre - centre).norm() < 0.06F * static_cast<float>(scene.model.diameter) &&
           v.q_view_model.angularDistance(rotation) < 0.25F;
  });
  // At random fewer than one vote in 10 000 would fall there.
  EXPECT_GT(static_cast<double>(near), 0.01 * static_cast<double>(votes.votes.size()));
}

TEST(Vote, IsTheSameOnAnyNumberOfThreads) {
  const VoteScene scene;
  const std::vector<int> starts = start_points(scene.points, 0.3);
  const Votes one = vote(scene.points, starts, scene.map, scene.model, DetectParams{}, {});
  for (const int threads : {2, 4}) {
    RunControl control;
    control.threads = threads;
    const Votes many = vote(scene.points, starts, scene.map, scene.model, DetectParams{}, control);
    ASSERT_EQ(many.votes.size(), one.votes.size());
    EXPECT_EQ(many.scene_pairs, one.scene_pairs);
    for (std::size_t i = 0; i < one.votes.size(); ++i) {
      ASSERT_EQ(many.votes[i].centre, one.votes[i].centre);
      ASSERT_EQ(many.votes[i].q_view_model.coeffs(), one.votes[i].q_view_model.coeffs());
    }
  }
}

TEST(Vote, ByFeaturesAloneIsGivenForEveryPairOfTheBins) {
  const VoteScene scene;
  DetectParams no_gate;
  no_gate.normal_tolerance = 180 * kDegree;
  const std::vector<int> starts = start_points(scene.points, 0.05);
  const Votes gated = vote(scene.points, starts, scene.map, scene.model, DetectParams{}, {});
  const Votes all = vote(scene.points, starts, scene.map, scene.model, no_gate, {});
  EXPECT_GT(all.votes.size(), 2 * gated.votes.size());
  for (const PoseVote& v : all.votes) ASSERT_TRUE(v.centre.allFinite() && v.weight > 0);
}

TEST(Vote, EndsWhenStopped) {
  const VoteScene scene;
  std::stop_source source;
  source.request_stop();
  RunControl control;
  control.stop = source.get_token();
  EXPECT_TRUE(
      vote(scene.points, start_points(scene.points, 1), scene.map, scene.model, DetectParams{}, control).votes.empty());
}

}  // namespace
}  // namespace binpose

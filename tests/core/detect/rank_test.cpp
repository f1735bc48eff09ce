#include "core/detect/rank.h"

#include <gtest/gtest.h>

#include <set>

#include "core/detect/ownership.h"
#include "tests/scenes/random.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

using Eigen::Vector3d;

/// Two equal parts side by side.
struct RankedScene {
  Model model;
  Pose poses[2];
  DepthMap map;
  std::vector<VerifyOptions> options;

  RankedScene(const Mesh& mesh, const Pose& first, const Pose& second)
      : model(testing::quick_model(mesh)), poses{first, second} {
    const testing::PlacedMesh bodies[] = {{mesh, first}, {mesh, second}};
    map = testing::scan_map(bodies, {}, model.diameter);
    VerifyOptions verification;
    verification.tolerance = static_cast<float>(0.012 * model.diameter);
    options = {verification};
  }
  Candidate candidate(const Pose& T_scene_model) const {
    Candidate c;
    c.T_view_model = testing::in_view(map, T_scene_model);
    c.evidence = verify(map, model, c.T_view_model, options[0]);
    return c;
  }
  Ranking rank_all(std::vector<Candidate> candidates, double min_score, int max_rejected) const {
    const Model* models[] = {&model};
    return rank(map, models, std::move(candidates),
                {.verification = options, .min_score = min_score, .max_rejected = max_rejected});
  }
  std::vector<Candidate> ranked(std::vector<Candidate> candidates, double min_score) const {
    return rank_all(std::move(candidates), min_score, 0).accepted;
  }
  bool is_at(const Candidate& c, const Pose& pose) const {
    const Eigen::Vector3f centre = model.centre.cast<float>();
    return (c.T_view_model * centre - testing::in_view(map, pose) * centre).norm() < 0.05 * model.diameter;
  }
};

RankedScene blocks() {
  return {testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {-0.07, 0, 0.43}),
          testing::pose(-35, {1, 0.2, 0.6}, {0.06, -0.01, 0.43})};
}

Pose shifted(const Pose& pose, double x) { return Eigen::Translation3d(x, 0, 0) * pose; }

TEST(Rank, KeepsOneOfEachInstanceBestFirst) {
  const RankedScene scene = blocks();
  std::vector<Candidate> candidates;
  for (const double x : {0.0006, -0.0006, 0.0, 0.001, -0.001}) {
    for (const Pose& pose : scene.poses) candidates.push_back(scene.candidate(shifted(pose, x)));
  }
  const std::vector<Candidate> kept = scene.ranked(candidates, 0.3);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_GE(kept[0].evidence.score(), kept[1].evidence.score());
  EXPECT_NE(scene.is_at(kept[0], scene.poses[0]), scene.is_at(kept[1], scene.poses[0]));
  EXPECT_NE(scene.is_at(kept[0], scene.poses[1]), scene.is_at(kept[1], scene.poses[1]));
}

TEST(Rank, SuppressesTheTurnsOfASymmetricPart) {
  const RankedScene scene(testing::hexagon(), testing::pose(10, Vector3d::UnitZ(), {-0.05, 0, 0.494}),
                          testing::pose(20, {1, 0, 3}, {0.05, 0, 0.48}));
  std::vector<Candidate> candidates;
  for (const Pose& pose : scene.poses) {
    for (int turn = 0; turn < 6; ++turn) {
      const Pose about_axis = testing::pose(60 * turn, Vector3d::UnitZ(), Vector3d::Zero());
      candidates.push_back(scene.candidate(pose * about_axis));
      candidates.push_back(
          scene.candidate(pose * about_axis * testing::pose(180, Vector3d::UnitX(), Vector3d::Zero())));
    }
  }
  EXPECT_EQ(scene.ranked(candidates, 0.3).size(), 2u);
}

TEST(Rank, DropsWhatScoresTooLittle) {
  const RankedScene scene = blocks();
  const Candidate good = scene.candidate(scene.poses[0]), bad = scene.candidate(shifted(scene.poses[1], 0.03));
  ASSERT_LT(bad.evidence.score(), 0.3F);
  EXPECT_EQ(scene.ranked({bad, good}, 0.3).size(), 1u);
  EXPECT_TRUE(scene.ranked({bad}, 0.3).empty());
  EXPECT_TRUE(scene.ranked({}, 0.3).empty());
}

TEST(Rank, KeepsApartTheBestOfThoseThatScoreTooLittle) {
  const RankedScene scene = blocks();
  const Candidate good = scene.candidate(scene.poses[0]), fair = scene.candidate(shifted(scene.poses[1], 0.0015));
  const Candidate hopeless = scene.candidate(shifted(scene.poses[1], 0.03));
  const double min_score = (good.score() + fair.score()) / 2;
  const Ranking ranking = scene.rank_all({hopeless, fair, good, fair}, min_score, 5);
  ASSERT_EQ(ranking.accepted.size(), 1u);
  ASSERT_GE(ranking.rejected.size(), 1u);
  EXPECT_EQ(ranking.rejected[0].score(), fair.score());
  for (const Candidate& rejected : ranking.rejected) EXPECT_GT(rejected.score(), 0);
  EXPECT_EQ(scene.rank_all({fair, good, fair}, min_score, 1).rejected.size(), 1u);
  EXPECT_TRUE(scene.rank_all({fair, good, fair}, min_score, 0).rejected.empty());
}

TEST(Rank, BelievesDoubtfulPosesOnlyBesideASureOne) {
  const RankedScene scene = blocks();
  const Candidate sure = scene.candidate(scene.poses[0]), doubtful = scene.candidate(shifted(scene.poses[1], 0.0018));
  ASSERT_LT(doubtful.score(), sure.score());
  const double between = 0.7 * sure.score();
  ASSERT_LT(doubtful.score(), between);
  const Model* models[] = {&scene.model};
  const auto rank_with = [&](const std::vector<Candidate>& candidates, double presence_score) {
    return rank(scene.map, models, candidates,
                {.verification = scene.options, .min_score = 0.1, .presence_score = presence_score, .max_rejected = 5});
  };
  EXPECT_EQ(rank_with({doubtful, sure}, between).accepted.size(), 2U);
  EXPECT_EQ(rank_with({doubtful, sure}, between).best_doubtful, 0);
  const Ranking alone = rank_with({doubtful}, between);
  EXPECT_TRUE(alone.accepted.empty());
  EXPECT_EQ(alone.best_doubtful, doubtful.presence());
  ASSERT_EQ(alone.rejected.size(), 1U);
  EXPECT_EQ(alone.rejected[0].score(), doubtful.score());
  EXPECT_EQ(rank_with({doubtful}, 0).accepted.size(), 1U);
}

TEST(Rank, AsksEachPoseOfAPartThatIsNotSurelyThereForProof) {
  const RankedScene scene = blocks();
  const Candidate better = scene.candidate(scene.poses[0]);
  const Candidate weak = scene.candidate(shifted(scene.poses[1], 0.0015));
  const Model* models[] = {&scene.model};
  const auto accepted_with = [&](double presence_score) {
    return rank(scene.map, models, {weak, better},
                {.verification = scene.options, .min_score = 0.1, .presence_score = presence_score})
        .accepted;
  };
  ASSERT_LT(weak.presence(), 0.9F * better.presence());
  EXPECT_EQ(accepted_with(0.7 * better.presence()).size(), 2U);
  ASSERT_EQ(accepted_with(0.95 * better.presence()).size(), 1U);
  EXPECT_EQ(accepted_with(0.95 * better.presence())[0].presence(), better.presence());
}

TEST(Rank, TakesAPoseOfWhichLittleShowsForWeakProof) {
  const RankedScene scene = blocks();
  const Candidate whole = scene.candidate(scene.poses[0]);
  Candidate edge_on = whole;
  edge_on.evidence.area = 0.5F;
  EXPECT_LT(edge_on.presence(), 0.6F * whole.presence());
  EXPECT_EQ(edge_on.presence(), 0.5F * edge_on.score());
  EXPECT_LE(whole.presence(), whole.score());
}

TEST(Rank, GivesBackWhatAnAbsentModelTook) {
  const RankedScene scene = blocks();
  Candidate first = scene.candidate(scene.poses[0]), second = scene.candidate(shifted(scene.poses[0], 0.0005));
  // As if the one's model showed much more on average, so that this pose proves it less.
  Model absent = scene.model, present = scene.model;
  for (float& area : absent.view_area) area *= 0.8F / first.evidence.area;
  for (float& area : present.view_area) area *= 1.1F / second.evidence.area;
  second.model_index = 1;
  const VerifyOptions options[] = {scene.options[0], scene.options[0]};
  const Model* models[] = {&absent, &present};
  const std::vector<Candidate> both = {first, second};
  const double presence_score = 0.99 * second.score();
  ASSERT_LT(0.8F * first.score(), presence_score);
  EXPECT_EQ(rank(scene.map, models, both, {.verification = options, .min_score = 0.1}).accepted.at(0).model_index, 0);
  const Ranking ranking =
      rank(scene.map, models, both, {.verification = options, .min_score = 0.1, .presence_score = presence_score});
  ASSERT_EQ(ranking.accepted.size(), 1U);
  EXPECT_EQ(ranking.accepted[0].model_index, 1);
  EXPECT_GE(ranking.accepted[0].score(), 0.99F * second.score());
  EXPECT_GT(ranking.best_doubtful, 0);
}

TEST(Rank, AsksEachModelForASureOneOfItsOwn) {
  const RankedScene scene = blocks();
  const Candidate sure = scene.candidate(scene.poses[0]);
  Candidate doubtful = scene.candidate(shifted(scene.poses[1], 0.0015));
  doubtful.model_index = 1;
  const VerifyOptions options[] = {scene.options[0], scene.options[0]};
  const Model* models[] = {&scene.model, &scene.model};
  const double between = (sure.score() + doubtful.score()) / 2;
  const Ranking ranking =
      rank(scene.map, models, {doubtful, sure}, {.verification = options, .min_score = 0.1, .presence_score = between});
  ASSERT_EQ(ranking.accepted.size(), 1U);
  EXPECT_EQ(ranking.accepted[0].model_index, 0);
}

TEST(Rank, CountsPartsWhoseMarkIsHiddenOrAcceptsThemWhereRivalsDoNotMatter) {
  const RankedScene scene(testing::marked_hexagon(), testing::pose(5, Vector3d::UnitX(), {-0.05, 0, 0.4}),
                          testing::pose(-4, Vector3d::UnitY(), {0.05, 0, 0.4}));
  const std::vector<Candidate> candidates = {scene.candidate(scene.poses[0]), scene.candidate(scene.poses[1])};
  const Model* models[] = {&scene.model};
  RankOptions options = {.verification = scene.options, .min_score = 0.4, .presence_score = 0.4};
  const Ranking strict = rank(scene.map, models, candidates, options);
  EXPECT_TRUE(strict.accepted.empty());
  EXPECT_EQ(strict.ambiguous_places, 2);
  options.accept_ambiguous = true;
  const Ranking lenient = rank(scene.map, models, candidates, options);
  EXPECT_EQ(lenient.ambiguous_places, 0);
  ASSERT_EQ(lenient.accepted.size(), 2U);
  for (const Candidate& candidate : lenient.accepted) {
    EXPECT_EQ(candidate.score(), candidate.evidence.score());
    EXPECT_LT(candidate.confidence, 0.3F);
    EXPECT_GE(candidate.rivals.size(), 5U);
  }
}

TEST(Rank, IsTheSameOnAnyNumberOfThreads) {
  const RankedScene scene = blocks();
  std::vector<Candidate> candidates;
  scenes::Random random(5);
  for (int i = 0; i < 60; ++i) {
    const Vector3d shift = random.rotation() * Vector3d(i % 3 == 0 ? 0.002 : 0.02, 0, 0);
    candidates.push_back(scene.candidate(Eigen::Translation3d(shift) * scene.poses[i % 2]));
  }
  const Model* models[] = {&scene.model};
  const RankOptions options = {.verification = scene.options, .min_score = 0.1, .max_rejected = 20};
  const Ranking one = rank(scene.map, models, candidates, options);
  ASSERT_GE(one.accepted.size(), 2U);
  ASSERT_GE(one.rejected.size(), 1U);
  for (const int threads : {2, 8}) {
    const Ranking many = rank(scene.map, models, candidates, options, {.threads = threads});
    const auto expect_same = [](const std::vector<Candidate>& a, const std::vector<Candidate>& b) {
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) {
        EXPECT_EQ(a[i].T_view_model.matrix(), b[i].T_view_model.matrix());
        EXPECT_EQ(a[i].score(), b[i].score());
        EXPECT_EQ(a[i].occluded_by, b[i].occluded_by);
      }
    };
    expect_same(many.accepted, one.accepted);
    expect_same(many.rejected, one.rejected);
  }
}

TEST(Ownership, ExplainedPixelsLieInTheImageBox) {
  const RankedScene scene = blocks();
  for (const Pose& pose : scene.poses) {
    const Candidate candidate = scene.candidate(pose);
    const std::vector<int> pixels =
        explained_pixels(scene.map, scene.model, candidate.T_view_model, scene.options[0].tolerance);
    const Eigen::AlignedBox2i box = image_box(scene.map, scene.model, candidate.T_view_model);
    EXPECT_LT(box.volume(), scene.map.width * scene.map.height / 3);
    for (const int i : pixels) {
      EXPECT_TRUE(box.contains(Eigen::Vector2i(i % scene.map.width, i / scene.map.width)));
    }
    EXPECT_GT(std::set<int>(pixels.begin(), pixels.end()).size(), 200);
  }
}

TEST(Ownership, ImageBoxOfAPartAroundTheSensorIsTheWholeImage) {
  const RankedScene scene = blocks();
  const Eigen::Isometry3f around(Eigen::Translation3f(-scene.model.centre.cast<float>()));
  const Eigen::AlignedBox2i box = image_box(scene.map, scene.model, around);
  EXPECT_TRUE(box.contains(Eigen::Vector2i(0, 0)));
  EXPECT_TRUE(box.contains(Eigen::Vector2i(scene.map.width - 1, scene.map.height - 1)));
}

TEST(Rank, OfEqualScoresKeepsTheOrderOfTheList) {
  const RankedScene scene = blocks();
  std::vector<Candidate> candidates(3, scene.candidate(scene.poses[0]));
  for (int i = 0; i < 3; ++i) candidates[i].votes = static_cast<float>(i);
  const std::vector<Candidate> kept = scene.ranked(candidates, 0.3);
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].votes, 0);
}

}  // namespace
}  // namespace binpose

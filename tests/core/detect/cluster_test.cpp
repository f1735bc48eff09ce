#include "core/detect/cluster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/params.h"
#include "tests/scenes/random.h"

namespace binpose {
namespace {

using Eigen::Quaternionf;
using Eigen::Vector3f;

ClusterOptions options() {
  ClusterOptions o;
  o.radius = 0.006F;
  o.most = 100;
  return o;
}

Quaternionf random_turn(scenes::Random& random, double angle) {
  return Quaternionf(
      Eigen::AngleAxisf(static_cast<float>(angle), (random.rotation() * Eigen::Vector3d::UnitX()).cast<float>()));
}

/// `count` votes of weight 1 for about the same pose.
void add_group(scenes::Random& random, const Vector3f& centre, const Quaternionf& q, int count,
               std::vector<PoseVote>& votes) {
  for (int i = 0; i < count; ++i) {
    const Vector3f offset = (random.rotation() * Eigen::Vector3d(random.uniform(0, 0.001), 0, 0)).cast<float>();
    Quaternionf turned = q * random_turn(random, random.uniform(0, 0.05));
    if (i % 2 == 1) turned.coeffs() = -turned.coeffs();  // the same rotation
    votes.push_back({centre + offset, 1, turned});
  }
}

bool agree(const Vector3f& centre, const Quaternionf& q, const PoseVote& vote, float radius, float angle) {
  return (vote.centre - centre).norm() < radius && vote.q_view_model.angularDistance(q) < angle;
}

struct Groups {
  std::vector<PoseVote> votes;
  std::vector<Vector3f> centres;
  std::vector<Quaternionf> rotations;
  static constexpr int kCounts[] = {90, 70, 50, 30};

  explicit Groups(std::uint64_t seed, int noise) {
    scenes::Random random(seed);
    for (int i = 0; i < 4; ++i) {
      const double x = (i < 2 ? 0 : 0.1) + random.uniform(0, 0.02);
      centres.emplace_back(static_cast<float>(x), 0.07F, 0.5F);
      rotations.push_back(random.rotation().cast<float>());
      add_group(random, centres[i], rotations[i], kCounts[i], votes);
    }
    for (int i = 0; i < noise; ++i) {
      votes.push_back(
          {Vector3f(static_cast<float>(random.uniform(-0.1, 0.2)), static_cast<float>(random.uniform(-0.1, 0.2)),
                    static_cast<float>(random.uniform(0.4, 0.6))),
           1, random.rotation().cast<float>()});
    }
    // Votes come mixed.
    for (std::size_t i = votes.size() - 1; i > 0; --i) std::swap(votes[i], votes[random.next() % (i + 1)]);
  }
};

TEST(Cluster, FindsEachGroupWhereverItLiesInTheBins) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Groups groups(seed, 3000);
    const std::vector<PoseCluster> found = cluster(groups.votes, options());
    for (int i = 0; i < 4; ++i) {
      const auto at_group = [&](const PoseCluster& c) {
        return (c.centre - groups.centres[i]).norm() < 0.001F &&
               c.q_view_model.angularDistance(groups.rotations[i]) < 0.05F;
      };
      const auto best = std::find_if(found.begin(), found.end(), at_group);
      ASSERT_NE(best, found.end()) << "seed " << seed << ", group " << i;
      EXPECT_LT(best - found.begin(), 8) << "seed " << seed << ", group " << i;
      // Where two components of the quaternion are about equally large, a group falls into two parts.
      EXPECT_GT(best->votes, 0.45F * Groups::kCounts[i]) << "seed " << seed << ", group " << i;
      EXPECT_LT(best->votes, static_cast<float>(Groups::kCounts[i]) + 4) << "seed " << seed << ", group " << i;
    }
  }
}

TEST(Cluster, KeepsAGroupWholeAcrossTheLimitsOfItsBins) {
  scenes::Random random(9);
  for (int trial = 0; trial < 200; ++trial) {
    // The rotation stays clear of where another component of the quaternion becomes the largest.
    const Quaternionf q = random_turn(random, random.uniform(0, 1));
    std::vector<PoseVote> votes;
    add_group(random, 0.1F * (random.rotation() * Eigen::Vector3d::UnitX()).cast<float>(), q, 50, votes);
    votes.push_back({Vector3f(-0.3F, -0.3F, -0.3F), 0.1F, q});  // where the bins begin
    const std::vector<PoseCluster> found = cluster(votes, options());
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NEAR(found[0].votes, 50, 1e-3F);
    EXPECT_LT(found[0].q_view_model.angularDistance(q), 0.05F);
  }
}

TEST(Cluster, HasAtMostTheVotesOfAQuadraticCountAndAboutTheBestOfThem) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Groups groups(seed, 2000);
    const ClusterOptions o = options();
    const std::vector<PoseCluster> found = cluster(groups.votes, o);
    for (const PoseCluster& c : found) {
      // A cell and its neighbours reach two cells across at most.
      const auto around = std::count_if(groups.votes.begin(), groups.votes.end(), [&](const PoseVote& v) {
        return agree(c.centre, c.q_view_model, v, 4 * o.radius, 3 * o.angle);
      });
      EXPECT_LE(c.votes, static_cast<float>(around) + 0.1F);
    }
    std::ptrdiff_t most = 0;
    for (const PoseVote& seed_vote : groups.votes) {
      most = std::max(most, std::count_if(groups.votes.begin(), groups.votes.end(), [&](const PoseVote& v) {
                        return agree(seed_vote.centre, seed_vote.q_view_model, v, 0.5F * o.radius, 0.5F * o.angle);
                      }));
    }
    EXPECT_GE(found[0].votes, 0.9F * static_cast<float>(most));
  }
}

TEST(Cluster, OrdersByVotesAndRepeatsNone) {
  const Groups groups(5, 5000);
  const ClusterOptions o = options();
  const std::vector<PoseCluster> found = cluster(groups.votes, o);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(found[i].q_view_model.norm(), 1, 1e-5F);
    EXPECT_LE(found[i].votes, found[i == 0 ? 0 : i - 1].votes);
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_FALSE((found[i].centre - found[j].centre).norm() < 0.99F * o.radius &&
                   found[i].q_view_model.angularDistance(found[j].q_view_model) < 0.99F * o.angle);
    }
  }
}

TEST(Cluster, KeepsNoMoreThanAskedFor) {
  const Groups groups(6, 5000);
  ClusterOptions o = options();
  o.most = 7;
  EXPECT_EQ(cluster(groups.votes, o).size(), 7u);
}

TEST(Cluster, WeighsVotes) {
  scenes::Random random(8);
  std::vector<PoseVote> votes;
  add_group(random, {0, 0, 0.5F}, Quaternionf::Identity(), 20, votes);
  add_group(random, {0.1F, 0, 0.5F}, Quaternionf::Identity(), 30, votes);
  for (int i = 0; i < 20; ++i) votes[i].weight = 5;
  const std::vector<PoseCluster> found = cluster(votes, options());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].votes, 100, 1e-3F);
  EXPECT_LT(found[0].centre.x(), 0.01F);
}

TEST(Cluster, OfNoneOneOrFarApartVotes) {
  EXPECT_TRUE(cluster({}, options()).empty());
  std::vector<PoseVote> votes = {{{0, 0, 0.5F}, 1, Quaternionf::Identity()}};
  EXPECT_EQ(cluster(votes, options()).size(), 1u);
  votes.push_back({{1e6F, -1e6F, 1e6F}, 1, Quaternionf::Identity()});
  votes.push_back({{1e30F, 0, 1e30F}, 1, Quaternionf::Identity()});
  EXPECT_GE(cluster(votes, options()).size(), 1u);
}

}  // namespace
}  // namespace binpose

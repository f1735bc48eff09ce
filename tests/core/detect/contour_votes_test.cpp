#include "core/detect/contour_votes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/detect/cluster.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

/// A plate flat on the floor: all that shows is one face and its rim.
struct Scene {
  Model model = testing::quick_model(testing::l_block());
  Pose T_scene_model = testing::pose(30, Eigen::Vector3d::UnitZ(), {-0.02, -0.02, 0.4875});
  DepthMap map;

  Scene() {
    const testing::PlacedMesh bodies[] = {{testing::l_block(), T_scene_model}};
    map = testing::scan_map(bodies, {}, model.diameter);
  }
};

TEST(ContourVotes, FindAPartOfWhichOnlyAFlatSideShows) {
  const Scene scene;
  const Votes votes = contour_votes(scene.map, scene.model, {});
  EXPECT_GT(votes.scene_pairs, 100u);
  ClusterOptions options;
  options.radius = static_cast<float>(0.06 * scene.model.diameter);
  options.neighbourhood = static_cast<float>(0.25 * scene.model.diameter);
  options.most_per_neighbourhood = 20;
  options.most = 100;
  const Eigen::Isometry3f truth = testing::in_view(scene.map, scene.T_scene_model);
  const std::vector<PoseCluster> clusters = cluster(votes.votes, options);
  const auto right = std::find_if(clusters.begin(), clusters.end(), [&](const PoseCluster& c) {
    return (c.centre - truth * scene.model.centre.cast<float>()).norm() < options.radius &&
           c.q_view_model.angularDistance(Eigen::Quaternionf(truth.linear())) < 0.2F;
  });
  ASSERT_NE(right, clusters.end());
  EXPECT_LT(right - clusters.begin(), 3) << "among the first";
}

TEST(ContourVotes, AreNoneWithoutContours) {
  Scene scene;
  scene.map.contours.clear();
  EXPECT_TRUE(contour_votes(scene.map, scene.model, {}).votes.empty());
}

TEST(ContourVotes, AreNoneOnTheBackground) {
  Scene scene;
  scene.map.background.assign(scene.map.points.size(), 1);
  EXPECT_TRUE(contour_votes(scene.map, scene.model, {}).votes.empty());
}

TEST(ContourVotes, AreTheSameOnAnyNumberOfThreads) {
  const Scene scene;
  const Votes one = contour_votes(scene.map, scene.model, {});
  for (const int threads : {2, 4}) {
    RunControl control;
    control.threads = threads;
    const Votes many = contour_votes(scene.map, scene.model, control);
    ASSERT_EQ(many.votes.size(), one.votes.size());
    for (std::size_t i = 0; i < one.votes.size(); ++i) ASSERT_EQ(many.votes[i].centre, one.votes[i].centre);
  }
}

}  // namespace
}  // namespace binpose

#include "core/detect/contour_votes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/detect/cluster.h"
#include "tests/scenes/random.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

/// A plate flat on the floor: all that shows is one face and its rim.
struct ContourScene {
  Model model = testing::quick_model(testing::l_block());
  Pose T_scene_model = testing::pose(30, Eigen::Vector3d::UnitZ(), {-0.02, -0.02, 0.4875});
  DepthMap map;

  ContourScene() {
    const testing::PlacedMesh bodies[] = {{testing::l_block(), T_scene_model}};
    map = testing::scan_map(bodies, {}, model.diameter);
  }
};

TEST(ContourVotes, FindAPartOfWhichOnlyAFlatSideShows) {
  const ContourScene scene;
  const Votes votes = contour_votes(scene.map, scene.model, 1, {});
  EXPECT_GT(votes.scene_pairs, 100u);
  ClusterOptions options;
  options.radius = static_cast<float>(0.06 * scene.model.diameter);
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

/// Contours of a few planes, far enough apart in the image that none is thinned out.
void scatter_contours(DepthMap& map) {
  constexpr int kStep = 8;  // pixels
  scenes::Random random(11);
  map.contours.clear();
  for (int v = kStep / 2; v < map.height; v += kStep) {
    for (int u = kStep / 2; u < map.width; u += kStep) {
      const float z = random.uniform(0, 1) < 0.5 ? 0.45F : 0.46F;
      const auto angle = static_cast<float>(random.uniform(0, 6.28));
      const auto tilt = static_cast<float>(random.uniform(0, 0.3));
      map.contours.push_back(
          {{(static_cast<float>(u) - map.cx) * z / map.focal, (static_cast<float>(v) - map.cy) * z / map.focal, z},
           {std::sin(tilt), 0, -std::cos(tilt)},
           {std::cos(angle), std::sin(angle), 0}});
    }
  }
  map.background.assign(map.pixels.size(), 0);
}

TEST(ContourVotes, ComeFromThePairsThatALoopOverAllFinds) {
  ContourScene scene;
  scatter_contours(scene.map);
  const auto diameter = static_cast<float>(scene.model.diameter);
  std::size_t pairs = 0;
  for (std::size_t a = 0; a < scene.map.contours.size(); ++a) {
    for (std::size_t b = a + 1; b < scene.map.contours.size(); ++b) {
      if (contour_frame(scene.map.contours[a], scene.map.contours[b], kShortestContourPair * diameter,
                        kLongestContourPair * diameter, kContourFlatness * diameter)) {
        ++pairs;
      }
    }
  }
  EXPECT_GT(pairs, 100U);
  EXPECT_EQ(contour_votes(scene.map, scene.model, 1, {}).scene_pairs, pairs);
}

TEST(ContourVotes, AreNoneWithoutContours) {
  ContourScene scene;
  scene.map.contours.clear();
  EXPECT_TRUE(contour_votes(scene.map, scene.model, 1, {}).votes.empty());
}

TEST(ContourVotes, AreNoneOnTheBackground) {
  ContourScene scene;
  scene.map.background.assign(scene.map.pixels.size(), 1);
  EXPECT_TRUE(contour_votes(scene.map, scene.model, 1, {}).votes.empty());
}

TEST(ContourVotes, AreTheSameOnAnyNumberOfThreads) {
  const ContourScene scene;
  const Votes one = contour_votes(scene.map, scene.model, 1, {});
  for (const int threads : {2, 4}) {
    RunControl control;
    control.threads = threads;
    const Votes many = contour_votes(scene.map, scene.model, 1, control);
    ASSERT_EQ(many.votes.size(), one.votes.size());
    for (std::size_t i = 0; i < one.votes.size(); ++i) ASSERT_EQ(many.votes[i].centre, one.votes[i].centre);
  }
}

}  // namespace
}  // namespace binpose

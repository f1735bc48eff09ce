#include "core/search_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/params.h"
#include "tests/scenes/random.h"
#include "tests/support/scan_map.h"

namespace binpose {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

/// A part of two halves that any turn about its axis leaves alone.
Symmetry spindle() {
  Symmetry symmetry;
  symmetry.discrete.push_back(testing::pose(180, Vector3d::UnitX(), {0, 0, 0.2}));
  symmetry.has_axis = true;
  symmetry.axis_point = {0.01, 0.02, 0};
  symmetry.axis_direction = Vector3d::UnitZ();
  return symmetry;
}

/// Four turns about z.
Symmetry square() {
  Symmetry symmetry;
  for (const double degrees : {90, 180, 270}) {
    symmetry.discrete.push_back(testing::pose(degrees, Vector3d::UnitZ(), {}));
  }
  return symmetry;
}

double trace_of(const Eigen::Matrix3d& weight, const Pose& pose) { return (weight * pose.linear()).trace(); }

TEST(Symmetry, TheBestEquivalentIsNoWorseThanAnyTurn) {
  scenes::Random random(5);
  const Symmetry symmetry = spindle();
  for (int i = 0; i < 20; ++i) {
    const Pose pose(Eigen::Translation3d(0.1, -0.2, 0.5) * random.rotation());
    const Eigen::Matrix3d weight = random.rotation().toRotationMatrix();
    double highest = -3;
    for (const Pose& T_model_model : symmetry.discrete) {
      for (int degree = 0; degree < 360; ++degree) {
        const Pose turned = pose * T_model_model * Eigen::AngleAxisd(degree * kDegree, symmetry.axis_direction);
        highest = std::max(highest, trace_of(weight, turned));
      }
    }
    const double found = trace_of(weight, best_equivalent(pose, symmetry, weight));
    EXPECT_GE(found, highest - 1e-9);
    EXPECT_LE(found, highest + 1e-3) << "no turn gives so much";
  }
}

TEST(Symmetry, AnEquivalentLeavesTheAxisWhereItIs) {
  const Symmetry symmetry = spindle();
  const Pose pose = testing::pose(30, {1, 2, 3}, {0.1, 0.2, 0.3});
  const Eigen::Matrix3d weight = testing::pose(100, {0, 1, 1}, {}).linear();
  const Pose found = best_equivalent(pose, symmetry, weight);
  const Vector3d on_axis = pose * symmetry.axis_point, direction = pose.linear() * symmetry.axis_direction;
  EXPECT_NEAR((found * symmetry.axis_point - on_axis).cross(direction).norm(), 0, 0.05);
  EXPECT_NEAR(std::abs((found.linear() * symmetry.axis_direction).dot(direction)), 1, 1e-9);
}

TEST(Symmetry, NoEquivalentThatIsBetterLeavesThePose) {
  const Pose pose = testing::pose(0, Vector3d::UnitZ(), {0.1, 0, 0});
  EXPECT_TRUE(best_equivalent(pose, square(), Eigen::Matrix3d::Identity()).isApprox(pose, 0));
  const Eigen::Matrix3d along_axis = Vector3d::UnitZ() * Vector3d::UnitZ().transpose();
  EXPECT_TRUE(best_equivalent(pose, spindle(), along_axis).isApprox(pose, 0)) << "any turn is as good";
}

TEST(Symmetry, EquivalentsAreAllButThePose) {
  const Pose pose = testing::pose(20, Vector3d::UnitY(), {0, 0, 1});
  const std::vector<Pose> others = equivalents_of(pose, square());
  ASSERT_EQ(others.size(), 3u);
  for (const Pose& other : others) {
    EXPECT_GT(rotation_distance(other, pose), 80 * kDegree);
    EXPECT_TRUE(other.linear().col(2).isApprox(pose.linear().col(2), 1e-12));
  }
}

SearchSpace cone(const Vector3d& model_direction, const Vector3d& scene_direction, double degrees) {
  PosePrior prior;
  prior.model_direction = model_direction;
  prior.scene_direction = scene_direction;
  prior.max_angle = degrees * kDegree;
  SearchSpace space;
  space.priors.push_back(prior);
  return space;
}

bool allows_pose(const SearchSpace& space, const Symmetry& symmetry, const Pose& pose, const Slack& slack = {}) {
  return allows(space, 0, symmetry, Vector3d::Zero(), pose, Vector3d::Zero(), slack);
}

TEST(SearchSpace, AConeHoldsWhatIsTurnedLessAndNoOtherModel) {
  const SearchSpace up = cone(Vector3d::UnitZ(), -Vector3d::UnitZ(), 30);
  EXPECT_TRUE(allows_pose(up, {}, testing::pose(155, Vector3d::UnitX(), {0, 0, 1})));
  EXPECT_FALSE(allows_pose(up, {}, testing::pose(145, Vector3d::UnitX(), {0, 0, 1})));
  EXPECT_TRUE(allows_pose(up, {}, testing::pose(145, Vector3d::UnitX(), {0, 0, 1}), {0, 10 * kDegree}));
  EXPECT_TRUE(allows(up, 1, {}, Vector3d::Zero(), Pose::Identity(), Vector3d::Zero()));
}

TEST(SearchSpace, AnEquivalentInTheConeIsEnoughAndIsGiven) {
  const SearchSpace along_x = cone(Vector3d::UnitX(), Vector3d::UnitY(), 10);
  const Pose pose = testing::pose(5, Vector3d::UnitX(), {0, 0, 1});
  EXPECT_FALSE(allows_pose(along_x, {}, pose));
  EXPECT_TRUE(allows_pose(along_x, square(), pose));
  const Pose given = turned_to_prior(along_x, 0, square(), pose);
  EXPECT_GT(given.linear().col(0).y(), std::cos(10 * kDegree));
  EXPECT_TRUE(turned_to_prior(along_x, 1, square(), pose).isApprox(pose, 0)) << "another model's prior";
}

TEST(SearchSpace, RegionsAndDistancesLimitTheCentre) {
  SearchSpace space;
  space.regions.push_back({testing::pose(45, Vector3d::UnitZ(), {0, 0, 1}), {0.4, 0.1, 0.1}});
  const auto at = [](double x, double y) { return testing::pose(0, Vector3d::UnitZ(), {x, y, 1}); };
  EXPECT_TRUE(allows_pose(space, {}, at(0.13, 0.13)));
  EXPECT_FALSE(allows_pose(space, {}, at(0.13, -0.13)));
  EXPECT_TRUE(allows_pose(space, {}, at(0.13, -0.13), {0.15, 0}));
  PosePrior near;
  near.min_distance = 0.5;
  near.max_distance = 1.01;
  space.priors.push_back(near);
  EXPECT_TRUE(allows_pose(space, {}, at(0, 0)));
  EXPECT_FALSE(allows_pose(space, {}, at(0.13, 0.13))) << "1.017 m away";
}

TEST(SearchSpace, RefusalsNameFieldAndLimit) {
  const auto why = [](const auto& change) {
    SearchSpace space;
    change(space);
    return std::string(validate(space).message());
  };
  const auto region = [&](const OrientedBox& box, std::size_t count = 1) {
    return why([&](SearchSpace& space) { space.regions.assign(count, box); });
  };
  const auto plane = [&](const Plane& given) { return why([&](SearchSpace& space) { space.support_plane = given; }); };
  const auto prior = [&](const auto& change, std::size_t count = 1) {
    PosePrior given;
    change(given);
    return why([&](SearchSpace& space) { space.priors.assign(count, given); });
  };
  Pose far = Pose::Identity();
  far.translation().x() = 1e9;
  EXPECT_EQ(why([](SearchSpace&) {}), "");
  EXPECT_THAT(region({Pose::Identity(), {1, 0, 1}}), HasSubstr("regions.size is (1, 0, 1) m"));
  EXPECT_THAT(region({far, {1, 1, 1}}), HasSubstr("within 1000 m"));
  EXPECT_THAT(region({Pose::Identity(), {1, 1, 1}}, 65), HasSubstr("may have 64"));
  EXPECT_THAT(why([](SearchSpace& space) {
                space.bin_interior = {Pose::Identity(), {1, 1, std::nan("")}};
              }),
              HasSubstr("bin_interior.size"));
  EXPECT_THAT(plane({Vector3d::Zero(), 0}), HasSubstr("support_plane.normal"));
  EXPECT_THAT(plane({Vector3d::UnitZ(), std::nan("")}), HasSubstr("support_plane.offset"));
  EXPECT_THAT(prior([](PosePrior& p) { p.max_angle = 0; }), HasSubstr("max_angle_degrees is 0"));
  EXPECT_THAT(prior([](PosePrior& p) { p.model_direction.setZero(); }), HasSubstr("model_direction"));
  EXPECT_THAT(prior([](PosePrior& p) { p.min_distance = 2, p.max_distance = 1; }), HasSubstr("min_distance is 2 m"));
  EXPECT_THAT(prior([](PosePrior&) {}, 2), HasSubstr("two entries for one model"));
}

}  // namespace
}  // namespace binpose

#include "server/convert_training.h"

#include <gtest/gtest.h>

#include <cmath>

namespace binpose::server {
namespace {

Pose turned(double degrees, const Eigen::Vector3d& axis, const Eigen::Vector3d& translation) {
  return Eigen::Translation3d(translation) * Eigen::AngleAxisd(degrees * kDegree, axis);
}

TEST(ModelToProto, ShowsTheSymmetryAndThePosesNearlyAlikeInMetres) {
  StoredModel stored;
  Model& model = stored.model;
  model.symmetry.discrete.push_back(turned(180, Eigen::Vector3d::UnitX(), {0, 0, 0.25}));
  model.symmetry.has_axis = true;
  model.symmetry.axis_point = {0.5, 0, 0};
  model.symmetry.axis_direction = Eigen::Vector3d::UnitY();
  model.similar_poses.push_back(turned(90, Eigen::Vector3d::UnitZ(), {0.125, 0, 0}));
  const v1::Model message = to_proto(stored);
  ASSERT_EQ(message.symmetry().discrete_size(), 2);
  EXPECT_EQ(message.symmetry().discrete(0).orientation().w(), 1);
  EXPECT_NEAR(std::abs(message.symmetry().discrete(1).orientation().x()), 1, 1e-12);
  EXPECT_EQ(message.symmetry().discrete(1).position().z(), 0.25);
  EXPECT_EQ(message.symmetry().axis().point().x(), 0.5);
  EXPECT_EQ(message.symmetry().axis().direction().y(), 1);
  ASSERT_EQ(message.similar_poses_size(), 1);
  EXPECT_EQ(message.similar_poses(0).position().x(), 0.125);
  EXPECT_NEAR(message.similar_poses(0).orientation().z(), std::sqrt(0.5), 1e-12);
}

TEST(ModelToProto, AnnouncesNoAxisWhereThereIsNone) { EXPECT_FALSE(to_proto(StoredModel()).symmetry().has_axis()); }

}  // namespace
}  // namespace binpose::server

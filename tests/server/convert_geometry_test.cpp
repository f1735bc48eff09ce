#include "server/convert_geometry.h"

#include <gtest/gtest.h>

#include <numbers>

namespace binpose::server {
namespace {

TEST(PoseToProto, TheQuaternionRotatesAsThePoseDoesAndItsRealPartIsNotNegative) {
  for (int i = 0; i < 64; ++i) {
    const Eigen::Vector3d axis = Eigen::Vector3d(i % 4 - 1.5, i % 3 - 1, i % 5 - 2).normalized();
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::AngleAxisd(i * std::numbers::pi / 16, axis).toRotationMatrix();
    const v1::Quaternion q = to_proto(pose, 1).orientation();
    EXPECT_GE(q.w(), 0);
    EXPECT_TRUE(Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()).toRotationMatrix().isApprox(pose.linear(), 1e-9));
  }
}

TEST(PoseToProto, ThePositionIsInTheUnitAskedFor) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(0.001, -0.5, 2);
  const v1::Vector3 position = to_proto(pose, 0.001).position();
  EXPECT_DOUBLE_EQ(position.x(), 1);
  EXPECT_DOUBLE_EQ(position.y(), -500);
  EXPECT_DOUBLE_EQ(position.z(), 2000);
}

}  // namespace
}  // namespace binpose::server

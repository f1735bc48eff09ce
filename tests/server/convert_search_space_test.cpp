#include "server/convert_search_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/convert_detection.h"

namespace binpose::server {
namespace {

using ::testing::HasSubstr;

google::protobuf::RepeatedPtrField<std::string> model_ids() {
  google::protobuf::RepeatedPtrField<std::string> ids;
  *ids.Add() = "bolt";
  *ids.Add() = "gear";
  return ids;
}

void set(v1::Vector3& vector, double x, double y, double z) {
  vector.set_x(x);
  vector.set_y(y);
  vector.set_z(z);
}

std::string why(const v1::DetectParams& message) {
  return std::string(to_detect_params(message, model_ids(), 0.001).status().message());
}

TEST(SearchSpaceConversion, LengthsBecomeMetresAndDirectionsUnits) {
  v1::DetectParams message;
  v1::OrientedBox& region = *message.add_regions();
  set(*region.mutable_pose()->mutable_position(), 100, 0, 800);
  region.mutable_pose()->mutable_orientation()->set_z(2);  // half a turn about z, of any length
  set(*region.mutable_size(), 300, 200, 150);
  set(*message.mutable_support_plane()->mutable_normal(), 0, 0, -4);
  message.mutable_support_plane()->set_offset(-900);
  v1::PosePrior& prior = *message.add_priors();
  prior.set_model_id("gear");
  set(*prior.mutable_scene_direction(), 0, 3, 4);
  prior.set_max_angle_degrees(30);
  prior.set_max_distance(1200);

  const absl::StatusOr<SearchSpace> space = to_search_space(message, model_ids(), 0.001);
  ASSERT_TRUE(space.ok()) << space.status();
  EXPECT_TRUE(space->regions.at(0).size.isApprox(Eigen::Vector3d(0.3, 0.2, 0.15)));
  EXPECT_TRUE(space->regions[0].contains({0.249, 0.099, 0.874}));
  EXPECT_FALSE(space->regions[0].contains({0.251, 0, 0.8}));
  EXPECT_TRUE(space->support_plane->normal.isApprox(-Eigen::Vector3d::UnitZ()));
  EXPECT_DOUBLE_EQ(space->support_plane->offset, -0.9);
  EXPECT_EQ(space->priors.at(0).model_index, 1);
  EXPECT_TRUE(space->priors[0].scene_direction.isApprox(Eigen::Vector3d(0, 0.6, 0.8)));
  EXPECT_TRUE(space->priors[0].model_direction.isApprox(Eigen::Vector3d::UnitZ())) << "the default";
  EXPECT_NEAR(space->priors[0].max_angle, 0.5236, 1e-4);
  EXPECT_DOUBLE_EQ(space->priors[0].max_distance, 1.2);
  EXPECT_FALSE(space->bin_interior.has_value());
}

TEST(SearchSpaceConversion, AnEffortIsABaseThatOtherFieldsChange) {
  v1::DetectParams message;
  message.set_effort(v1::EFFORT_THOROUGH);
  const DetectParams thorough = *to_detect_params(message, model_ids(), 1);
  EXPECT_EQ(thorough, DetectParams::thorough());
  message.set_start_point_share(0.3);
  EXPECT_EQ(to_detect_params(message, model_ids(), 1)->start_point_share, 0.3);
  message.set_effort(v1::EFFORT_FAST);
  EXPECT_EQ(to_detect_params(message, model_ids(), 1)->refine_limit, DetectParams::fast().refine_limit);
}

TEST(SearchSpaceConversion, RefusalsNameTheField) {
  v1::DetectParams message;
  message.set_effort(static_cast<v1::Effort>(9));
  EXPECT_THAT(why(message), HasSubstr("effort is 9"));

  message = {};
  message.add_priors()->set_model_id("nut");
  EXPECT_THAT(why(message), HasSubstr("priors.model_id is 'nut'; it must be one of the request's model_ids"));

  message = {};
  message.mutable_reference_orientation()->set_w(0);
  EXPECT_THAT(why(message), HasSubstr("reference_orientation"));
  message.mutable_reference_orientation()->set_w(std::nan(""));
  EXPECT_THAT(why(message), HasSubstr("reference_orientation"));

  message = {};
  message.mutable_bin_interior()->mutable_pose()->mutable_orientation();
  EXPECT_THAT(why(message), HasSubstr("bin_interior.pose.orientation"));

  message = {};
  message.add_regions();
  EXPECT_THAT(why(message), HasSubstr("regions.size is (0, 0, 0) m"));

  message = {};
  message.mutable_support_plane();
  EXPECT_THAT(why(message), HasSubstr("support_plane.normal"));
}

}  // namespace
}  // namespace binpose::server

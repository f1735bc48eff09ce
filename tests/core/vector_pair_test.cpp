#include "core/vector_pair.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/params.h"
#include "tests/scenes/random.h"

namespace binpose {
namespace {

using Eigen::Vector3f;

Vector3f at_angle(double degrees) {
  return {static_cast<float>(std::cos(degrees * kDegree)), static_cast<float>(std::sin(degrees * kDegree)), 0};
}

TEST(PairFrame, HasItsColumnsAlongBothVectorsAndTheirCrossProduct) {
  const Vector3f p(1, 2, 3);
  const Eigen::Matrix3f frame = pair_frame(p, p + Vector3f(0, 0.3F, 0), p + Vector3f(0, 0, 0.2F));
  EXPECT_TRUE(frame.col(0).isApprox(Vector3f(0, 1, 0), 1e-6F));
  EXPECT_TRUE(frame.col(1).isApprox(Vector3f(0, 0, 1), 1e-6F));
  EXPECT_TRUE(frame.col(2).isApprox(Vector3f(1, 0, 0), 1e-6F));
}

TEST(PairFrame, SharesTheErrorOfASkewPairEvenlyAndStaysOrthonormal) {
  const Eigen::Matrix3f frame = pair_frame(Vector3f::Zero(), at_angle(0), at_angle(94));
  EXPECT_TRUE(frame.isUnitary(1e-5F));
  EXPECT_NEAR(frame.determinant(), 1, 1e-5);
  EXPECT_TRUE(frame.col(0).isApprox(at_angle(2), 1e-5F));
  EXPECT_TRUE(frame.col(1).isApprox(at_angle(92), 1e-5F));
}

TEST(PairFeature, IsTheCosineOfEachNormalWithTheTriangles) {  // Eq. (1)
  const SurfacePoint p{{0, 0, 0}, {0, 0, 1}};
  const SurfacePoint q1{{0.3F, 0, 0}, {0.5F, 0, std::sqrt(0.75F)}};
  const SurfacePoint q2{{0, 0.2F, 0}, {0, 0.8F, -0.6F}};
  const PairNormals normals = pair_normals(pair_frame(p.position, q1.position, q2.position), p, q1, q2);
  EXPECT_NEAR(normals(2, 0), 1, 1e-6);
  EXPECT_NEAR(normals(2, 1), std::sqrt(0.75), 1e-6);
  EXPECT_NEAR(normals(2, 2), -0.6, 1e-6);
  // What Eq. (1) leaves out: the rest of each normal.
  EXPECT_NEAR(normals(0, 1), 0.5, 1e-6);
  EXPECT_NEAR(normals(1, 2), 0.8, 1e-6);
}

TEST(PairFeature, DoesNotChangeWithThePose) {
  scenes::Random random(1);
  for (int i = 0; i < 50; ++i) {
    const auto point = [&] {
      return SurfacePoint{(random.rotation() * Eigen::Vector3d(0, 0, 0.1)).cast<float>(),
                          (random.rotation() * Eigen::Vector3d::UnitX()).cast<float>()};
    };
    const SurfacePoint p = point(), q1 = point(), q2 = point();
    const Eigen::Quaternionf R = random.rotation().cast<float>();
    const auto moved = [&](const SurfacePoint& s) {
      return SurfacePoint{R * s.position + Vector3f(0.1F, 0.2F, 0.5F), R * s.normal};
    };
    const SurfacePoint moved_p = moved(p), moved_q1 = moved(q1), moved_q2 = moved(q2);
    const PairNormals before = pair_normals(pair_frame(p.position, q1.position, q2.position), p, q1, q2);
    const PairNormals after =
        pair_normals(pair_frame(moved_p.position, moved_q1.position, moved_q2.position), moved_p, moved_q1, moved_q2);
    EXPECT_TRUE(before.isApprox(after, 1e-4F)) << i;
  }
}

TEST(PairRotation, IsTheProductOfTheTwoFrames) {  // Eq. (8)
  scenes::Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Matrix3f R = random.rotation().cast<float>().toRotationMatrix();
    const Vector3f t(0.4F, -0.1F, 0.6F), p(0.01F, 0.02F, 0.03F), q1(0.04F, 0.02F, 0.03F), q2(0.01F, 0.02F, 0.05F);
    const Eigen::Matrix3f M_m = pair_frame(p, q1, q2);
    const Eigen::Matrix3f M_s = pair_frame(R * p + t, R * q1 + t, R * q2 + t);
    EXPECT_TRUE((M_s * M_m.transpose()).isApprox(R, 1e-4F)) << i;
  }
}

TEST(FeatureBins, OfTwelveDegreesAreFifteenPerCosine) {
  const FeatureBins bins(12 * kDegree);
  EXPECT_EQ(bins.per_axis(), 15);
  EXPECT_EQ(bins.count(), 15 * 15 * 15);
}

TEST(FeatureBins, CoverTheHalfCircleForAnyWidth) {
  for (const double degrees : {4.0, 7.0, 12.0, 44.0, 45.0}) {
    const FeatureBins bins(degrees * kDegree);
    EXPECT_EQ(bins.per_axis(), static_cast<int>(std::ceil(180 / degrees - 1e-9))) << degrees;
    EXPECT_EQ(bins.axis_bin(1), 0);
    EXPECT_EQ(bins.axis_bin(-1), bins.per_axis() - 1);
    EXPECT_EQ(bins.axis_bin(1.001F), 0);
    EXPECT_EQ(bins.axis_bin(-1.001F), bins.per_axis() - 1);
  }
}

TEST(FeatureBins, AgreeWithTheAngleExceptNextToALimit) {
  const double width = 12 * kDegree;
  const FeatureBins bins(width);
  for (int i = -999; i <= 999; ++i) {
    const double s = i / 1000.0;
    const int low = static_cast<int>(std::acos(std::min(1.0, s + 1.0 / 1024)) / width);
    const int high = static_cast<int>(std::acos(std::max(-1.0, s - 1.0 / 1024)) / width);
    EXPECT_GE(bins.axis_bin(static_cast<float>(s)), low) << s;
    EXPECT_LE(bins.axis_bin(static_cast<float>(s)), std::min(high, 14)) << s;
  }
}

TEST(FeatureBins, OfAFeatureAreDistinctForDistinctAxisBins) {
  const FeatureBins bins(12 * kDegree);
  EXPECT_EQ(bins.bin(1, 1, 1), 0);
  EXPECT_EQ(bins.bin(-1, -1, -1), bins.count() - 1);
  const float s = std::cos(18 * static_cast<float>(kDegree));  // the middle of bin 1
  EXPECT_EQ(bins.bin(1, 1, s), 1);
  EXPECT_EQ(bins.bin(1, s, 1), 15);
  EXPECT_EQ(bins.bin(s, 1, 1), 225);
}

}  // namespace
}  // namespace binpose

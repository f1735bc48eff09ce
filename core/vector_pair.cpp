#include "core/vector_pair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace binpose {

Eigen::Matrix3f pair_frame(const Eigen::Vector3f& p, const Eigen::Vector3f& q1, const Eigen::Vector3f& q2) {
  const Eigen::Vector3f a = (q1 - p).normalized();
  const Eigen::Vector3f b = (q2 - p).normalized();
  // Sum and difference of unit vectors are orthogonal whatever the angle; turned by 45 degrees they straddle a and b.
  const Eigen::Vector3f sum = (a + b).normalized();
  const Eigen::Vector3f difference = (a - b).normalized();
  Eigen::Matrix3f frame;
  frame.col(0) = (sum + difference) * std::numbers::sqrt2_v<float> * 0.5F;
  frame.col(1) = (sum - difference) * std::numbers::sqrt2_v<float> * 0.5F;
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

FeatureBins::FeatureBins(double bin_width)
    : per_axis_(static_cast<int>(std::ceil(std::numbers::pi / bin_width - 1e-9))) {
  for (int i = 0; i <= kCells; ++i) {
    const double cosine = std::clamp((i + 0.5) * 2.0 / kCells - 1.0, -1.0, 1.0);
    bin_of_cosine_[i] =
        static_cast<std::uint8_t>(std::min(per_axis_ - 1, static_cast<int>(std::acos(cosine) / bin_width)));
  }
}

}  // namespace binpose

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/depth_map.h"
#include "core/heap_bytes.h"
#include "core/run_control.h"
#include "core/slots.h"

namespace binpose {

/// Two contour points of one plane, as indices into a list. They give a whole pose where a flat face gives none.
struct ContourPair {
  std::uint16_t a, b;
};

/// What two coplanar contour points look like: their distance and how each outward direction lies to the line from a to
/// b, radians in [-pi, pi], counted about the common normal.
struct ContourFeature {
  float distance;
  float angle_a, angle_b;
};

/// A pair seen as a frame: x from a to b, z along the common normal, origin in a.
struct ContourFrame {
  Eigen::Isometry3f T_outer_pair;
  ContourFeature feature;
};

/// The frame and feature of two contour points; none when their normals differ by more than 15 degrees, when one lies
/// more than `flatness` off the other's plane, or when their distance is outside [shortest, longest]. Metres.
std::optional<ContourFrame> contour_frame(const ContourPoint& a, const ContourPoint& b, float shortest, float longest,
                                          float flatness);

inline constexpr float kSameNormalCosine = 0.9659258F;  ///< 15 degrees

/// Lengths of contour pairs, as shares of the diameter.
inline constexpr float kShortestContourPair = 0.2F;
inline constexpr float kLongestContourPair = 0.7F;
inline constexpr float kContourFlatness = 0.025F;

/// Look-up from feature to the model's contour pairs. Scene pairs may come in either order of their points.
class ContourTable {
 public:
  /// What a match votes for, in the pair's frame.
  struct Vote {
    Eigen::Vector3f centre_in_pair;
    float weight;
    Eigen::Quaternionf rotation_pair_model;
  };

  ContourTable() = default;
  /// @param centre  of the model, the point that is voted for.
  /// Holds part of the pairs when `control` interrupts.
  ContourTable(std::span<const ContourPoint> points, std::span<const ContourPair> pairs, std::span<const float> weights,
               const Eigen::Vector3f& centre, float diameter, const RunControl& control = {});

  /// Calls `use(vote)` for each pair whose distance and angles agree with the feature within the tolerances below.
  template <typename Use>
  void for_each_match(const ContourFeature& feature, Use&& use) const {
    if (slots_.first.empty()) return;
    const std::uint32_t slot =
        slot_of(distance_bin(feature.distance), angle_bin(feature.angle_a), angle_bin(feature.angle_b));
    for (std::uint32_t i = slots_.first[slot]; i < slots_.first[slot + 1]; ++i) {
      const Entry& entry = slots_.items[i];
      if (std::abs(entry.feature.distance - feature.distance) <= distance_tolerance_ &&
          turn(entry.feature.angle_a, feature.angle_a) <= kAngleTolerance &&
          turn(entry.feature.angle_b, feature.angle_b) <= kAngleTolerance) {
        use(votes_[entry.vote]);
      }
    }
  }
  std::size_t memory_bytes() const { return heap_bytes(votes_) + heap_bytes(slots_.first) + heap_bytes(slots_.items); }

 private:
  static constexpr int kDistanceBins = 32;
  static constexpr int kAngleBins = 24;
  static constexpr float kAngleTolerance = 0.2617994F;         // 15 degrees, the width of a bin
  static constexpr float kRelativeDistanceTolerance = 0.018F;  // of the diameter

  struct Entry {
    ContourFeature feature;
    std::uint32_t vote;
  };

  /// Smallest turn between two angles.
  static float turn(float a, float b) {
    const float d = std::abs(a - b);
    return d > 3.14159265F ? 6.2831853F - d : d;
  }
  int distance_bin(float distance) const;
  static int angle_bin(float angle);
  static std::uint32_t slot_of(int distance, int a, int b) {
    return (static_cast<std::uint32_t>(distance) * kAngleBins + a) * kAngleBins + b;
  }

  float diameter_ = 1, distance_tolerance_ = 0;
  std::vector<Vote> votes_;
  Slots<Entry> slots_;
};

}  // namespace binpose

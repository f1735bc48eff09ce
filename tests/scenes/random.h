#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace binpose::scenes {

/// Random numbers that are the same on every machine and with every standard library (SplitMix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  /// The generator of the n-th of many independent draws, so that skipping one leaves the others as they are.
  Random fork(std::uint64_t n) const { return Random(Random(state_ ^ (n + 1) * 0xd1342543de82ef95U).next()); }

  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }

  /// Evenly distributed in [low, high).
  double uniform(double low, double high) { return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53; }

  /// Normally distributed, mean 0, deviation 1 (Box-Muller).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
    return radius * std::cos(uniform(0, 2 * std::numbers::pi));
  }

  /// Evenly distributed over all rotations (a normalised 4-D Gaussian).
  Eigen::Quaterniond rotation() {
    const double w = normal(), x = normal(), y = normal(), z = normal();
    return Eigen::Quaterniond(w, x, y, z).normalized();
  }

 private:
  std::uint64_t state_;
};

}  // namespace binpose::scenes

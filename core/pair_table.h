#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "core/heap_bytes.h"
#include "core/run_control.h"
#include "core/vector_pair.h"

namespace binpose {

/// Hash table from feature bin to the model pairs that a scene pair of that feature may correspond to
/// [paper, section IV 3].
///
/// A pair stands in every bin that lies within `margin` of its feature, so that one look-up finds it despite noise.
/// The normals of 8 pairs lie together, component by component, for one vector comparison of all of them.
class PairTable {
 public:
  static constexpr int kBlock = 8;
  /// Scale of the normals' components: three products of two such numbers fit 16 bits.
  static constexpr int kUnit = 100;

  /// Normals of 8 pairs in their pair frames, times kUnit: component c of normal k of pair i is normals[3 k + c][i].
  struct Block {
    std::int16_t normals[9][kBlock];
    std::uint32_t pair[kBlock];  ///< index into Model::pairs; kNoPair pads the last block of a bin
  };
  static constexpr std::uint32_t kNoPair = 0xFFFFFFFF;

  /// What a match of a pair votes for.
  struct Vote {
    Eigen::Quaternionf rotation_frame_model;  ///< M_m^T of [Eq. 8]
    Eigen::Vector3f centre_in_frame;          ///< the offset d_c from P to the model's centre, in the pair's frame
    float weight;
  };

  PairTable() : bins_(1.0) {}
  /// @param scale_count  number of pair lengths; each has its own set of bins.
  /// Holds part of the pairs when `control` interrupts.
  PairTable(std::span<const SurfacePoint> points, std::span<const VectorPair> pairs, std::span<const float> weights,
            const Eigen::Vector3f& centre, int scale_count, double bin_width, double margin,
            const RunControl& control = {});

  const FeatureBins& bins() const { return bins_; }
  /// The blocks of a bin of a scale.
  std::span<const Block> find(int scale, int bin) const {
    const std::size_t slot = static_cast<std::size_t>(scale) * bins_.count() + bin;
    return {blocks_.data() + first_block_[slot], blocks_.data() + first_block_[slot + 1]};
  }
  const Vote& vote(std::uint32_t pair) const { return votes_[pair]; }
  std::size_t memory_bytes() const { return heap_bytes(first_block_) + heap_bytes(blocks_) + heap_bytes(votes_); }

 private:
  FeatureBins bins_;
  std::vector<std::uint32_t> first_block_;
  std::vector<Block> blocks_;
  std::vector<Vote> votes_;
};

}  // namespace binpose

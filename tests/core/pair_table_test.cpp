#include "core/pair_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/params.h"
#include "tests/scenes/random.h"

namespace binpose {
namespace {

constexpr double kWidth = 12 * kDegree;
constexpr double kMargin = 6 * kDegree;
constexpr int kScales = 2;

/// Random surface points and pairs of them.
struct Pairs {
  std::vector<SurfacePoint> points;
  std::vector<VectorPair> pairs;
  std::vector<float> weights;
  Eigen::Vector3f centre{0.01F, -0.02F, 0.03F};

  explicit Pairs(int count) {
    scenes::Random random(7);
    for (int i = 0; i < count; ++i) {
      const auto p = static_cast<std::uint16_t>(points.size());
      const Eigen::Quaterniond turn = random.rotation();
      const Eigen::Vector3d start = random.rotation() * Eigen::Vector3d(0.05, 0, 0);
      for (const Eigen::Vector3d& offset :
           {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.03, 0, 0), Eigen::Vector3d(0.001, 0.02, 0)}) {
        points.push_back(
            {(start + turn * offset).cast<float>(), (random.rotation() * Eigen::Vector3d::UnitZ()).cast<float>()});
      }
      pairs.push_back({p, static_cast<std::uint16_t>(p + 1), static_cast<std::uint16_t>(p + 2),
                       static_cast<std::uint16_t>(i % kScales)});
      weights.push_back(1 + static_cast<float>(i));
    }
  }
  Eigen::Matrix3f frame(const VectorPair& v) const {
    return pair_frame(points[v.p].position, points[v.q1].position, points[v.q2].position);
  }
  PairNormals normals(const VectorPair& v) const {
    return pair_normals(frame(v), points[v.p], points[v.q1], points[v.q2]);
  }
  PairTable table() const { return {points, pairs, weights, centre, kScales, kWidth, kMargin}; }
};

std::vector<std::uint32_t> found(const PairTable& table, int scale, int bin) {
  std::vector<std::uint32_t> pairs;
  for (const PairTable::Block& block : table.find(scale, bin)) {
    for (const std::uint32_t pair : block.pair) {
      if (pair != PairTable::kNoPair) pairs.push_back(pair);
    }
  }
  return pairs;
}

double angle_of(float s) { return std::acos(std::clamp(static_cast<double>(s), -1.0, 1.0)); }

/// Whether the bin of a cosine may hold an angle within the margin of another's.
bool may_match(const FeatureBins& bins, float model, int bin) {
  const double angle = angle_of(model);
  return bins.axis_bin(static_cast<float>(std::cos(std::max(0.0, angle - kMargin)))) <= bin &&
         bin <= bins.axis_bin(static_cast<float>(std::cos(std::min(std::acos(-1.0), angle + kMargin))));
}

TEST(PairTable, FindsInEachBinJustThePairsOfALinearScan) {
  const Pairs pairs(150);
  const PairTable table = pairs.table();
  const FeatureBins& bins = table.bins();
  const int n = bins.per_axis();
  for (int scale = 0; scale < kScales; ++scale) {
    for (int bin = 0; bin < bins.count(); ++bin) {
      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < pairs.pairs.size(); ++i) {
        const PairNormals normals = pairs.normals(pairs.pairs[i]);
        if (pairs.pairs[i].scale == scale && may_match(bins, normals(2, 0), bin / (n * n)) &&
            may_match(bins, normals(2, 1), bin / n % n) && may_match(bins, normals(2, 2), bin % n)) {
          expected.push_back(i);
        }
      }
      ASSERT_EQ(found(table, scale, bin), expected) << "scale " << scale << ", bin " << bin;
    }
  }
}

TEST(PairTable, FindsAPairDespiteNoiseOfUpToTheMargin) {
  const Pairs pairs(200);
  const PairTable table = pairs.table();
  scenes::Random random(3);
  for (std::uint32_t i = 0; i < pairs.pairs.size(); ++i) {
    const PairNormals normals = pairs.normals(pairs.pairs[i]);
    for (int trial = 0; trial < 20; ++trial) {
      float s[3];
      for (int k = 0; k < 3; ++k) {
        const double angle = angle_of(normals(2, k)) + random.uniform(-0.999, 0.999) * kMargin;
        s[k] = static_cast<float>(std::cos(std::clamp(angle, 0.0, std::acos(-1.0))));
      }
      const std::vector<std::uint32_t> candidates =
          found(table, pairs.pairs[i].scale, table.bins().bin(s[0], s[1], s[2]));
      EXPECT_EQ(std::count(candidates.begin(), candidates.end(), i), 1) << i;
    }
  }
}

TEST(PairTable, KeepsTheNormalsToHalfAUnitAndPadsWithNone) {
  const Pairs pairs(60);
  const PairTable table = pairs.table();
  for (int scale = 0; scale < kScales; ++scale) {
    for (int bin = 0; bin < table.bins().count(); ++bin) {
      for (const PairTable::Block& block : table.find(scale, bin)) {
        for (int lane = 0; lane < PairTable::kBlock; ++lane) {
          const bool used = block.pair[lane] != PairTable::kNoPair;
          const PairNormals normals =
              used ? pairs.normals(pairs.pairs[block.pair[lane]]) : PairNormals(PairNormals::Zero());
          for (int c = 0; c < 9; ++c) {
            EXPECT_NEAR(block.normals[c][lane], PairTable::kUnit * normals(c % 3, c / 3), used ? 0.501 : 0);
          }
        }
      }
    }
  }
}

TEST(PairTable, VotesForTheCentreAsSeenFromThePair) {
  const Pairs pairs(50);
  const PairTable table = pairs.table();
  for (std::uint32_t i = 0; i < pairs.pairs.size(); ++i) {
    const Eigen::Matrix3f M_m = pairs.frame(pairs.pairs[i]);
    const PairTable::Vote& vote = table.vote(i);
    EXPECT_TRUE(vote.rotation_frame_model.toRotationMatrix().isApprox(M_m.transpose(), 1e-4F));
    const Eigen::Vector3f centre = pairs.points[pairs.pairs[i].p].position + M_m * vote.centre_in_frame;
    EXPECT_TRUE(centre.isApprox(pairs.centre, 1e-4F));
    EXPECT_EQ(vote.weight, pairs.weights[i]);
  }
}

TEST(PairTable, OfNoPairsFindsNone) {
  const PairTable table({}, {}, {}, Eigen::Vector3f::Zero(), 1, kWidth, kMargin);
  for (int bin = 0; bin < table.bins().count(); ++bin) EXPECT_TRUE(table.find(0, bin).empty());
}

}  // namespace
}  // namespace binpose

#include "core/io/model_file.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/detect/detect.h"
#include "tests/support/scan_map.h"
#include "tests/support/shapes.h"

namespace binpose {
namespace {

const Model& model() {
  static const Model trained = testing::quick_model(testing::l_block());
  return trained;
}

/// A small model, as bytes are tried one after the other.
std::string small_bytes() {
  Model small = model();
  small.surface.resize(20);
  small.visibility.resize(20);
  small.pairs.resize(30);
  small.pair_weights.resize(30);
  small.contour_pairs.resize(10);
  small.contour_weights.resize(10);
  for (std::vector<ContourPoint>& outline : small.outlines) outline.resize(1);
  small.warnings = {"odd"};
  return serialize_model(small);
}

TEST(ModelFile, GivesBackAModelThatSavesToTheSameBytes) {
  const std::string bytes = serialize_model(model());
  const absl::StatusOr<Model> read = parse_model(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(serialize_model(*read) == bytes);
  EXPECT_EQ(content_hash(*read), content_hash(model()));
  EXPECT_EQ(read->params, model().params);
}

TEST(ModelFile, GivesBackAModelThatDetectsTheSame) {
  const absl::StatusOr<Model> read = parse_model(serialize_model(model()));
  ASSERT_TRUE(read.ok());
  const testing::PlacedMesh bodies[] = {{testing::l_block(), testing::pose(40, {1, 0.5, 0.2}, {0, 0, 0.43})}};
  const PointCloud cloud = testing::render(bodies, {});
  const Model *trained[] = {&model()}, *loaded[] = {&*read};
  const DetectResult expected = *detect(cloud, trained, {}, {}), result = *detect(cloud, loaded, {}, {});
  ASSERT_GE(expected.hypotheses.size(), 1u);
  ASSERT_EQ(result.hypotheses.size(), expected.hypotheses.size());
  for (std::size_t i = 0; i < expected.hypotheses.size(); ++i) {
    EXPECT_EQ(result.hypotheses[i].T_scene_model.matrix(), expected.hypotheses[i].T_scene_model.matrix());
    EXPECT_EQ(result.hypotheses[i].score, expected.hypotheses[i].score);
  }
}

TEST(ModelFile, HashHas64DigitsAndTellsModelsApart) {
  EXPECT_EQ(content_hash(model()).size(), 64u);
  EXPECT_EQ(content_hash(model()).find_first_not_of("0123456789abcdef"), std::string::npos);
  Model other = model();
  other.warnings.emplace_back("odd");
  EXPECT_NE(content_hash(other), content_hash(model()));
}

TEST(ModelFile, RefusesEveryPrefix) {
  const std::string bytes = small_bytes();
  ASSERT_TRUE(parse_model(bytes).ok());
  for (std::size_t length = 0; length < bytes.size(); length += length < 200 ? 1 : 97) {
    EXPECT_EQ(parse_model(bytes.substr(0, length)).status().code(), absl::StatusCode::kDataLoss) << length;
  }
  EXPECT_FALSE(parse_model(bytes + "x").ok());
}

TEST(ModelFile, RefusesEveryFlippedByte) {
  const std::string bytes = small_bytes();
  for (std::size_t i = 0; i < bytes.size(); i += i < 200 ? 1 : 53) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ 0x10);
    const absl::StatusOr<Model> read = parse_model(flipped);
    EXPECT_TRUE(read.status().code() == absl::StatusCode::kDataLoss ||
                (i >= 8 && i < 12 && read.status().code() == absl::StatusCode::kUnimplemented))
        << i << ": " << read.status();
  }
}

TEST(ModelFile, RefusesForeignBytes) {
  EXPECT_EQ(parse_model("").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(parse_model("solid cube\nfacet normal 0 0 1").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(parse_model(std::string(100'000, '\xff')).status().code(), absl::StatusCode::kDataLoss);
}

/// One field made wrong; the checksum is right, as of a file that was made to look good.
struct Wrong {
  const char* what;
  void (*spoil)(Model&);
};

TEST(ModelFile, RefusesAModelThatContradictsItselfUnderARightChecksum) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Wrong cases[] = {
      {"pair index", [](Model& m) { m.pairs[3].q1 = 65535; }},
      {"pair of one point", [](Model& m) { m.pairs[3].q1 = m.pairs[3].p; }},
      {"pair scale", [](Model& m) { m.pairs[3].scale = 7; }},
      {"pair weights", [](Model& m) { m.pair_weights.pop_back(); }},
      {"negative weight", [](Model& m) { m.pair_weights[0] = -1; }},
      {"weight", [](Model& m) { m.pair_weights[0] = kNan; }},
      {"contour index", [](Model& m) { m.contour_pairs[3].a = 65535; }},
      {"contour weights", [](Model& m) { m.contour_weights.pop_back(); }},
      {"contour point", [](Model& m) { m.contour_points[0].position.x() = kNan; }},
      {"visibility", [](Model& m) { m.visibility.pop_back(); }},
      {"outlines", [](Model& m) { m.outlines.pop_back(); }},
      {"outline point", [](Model& m) { m.outlines[0][0].outward.x() = kNan; }},
      {"surface point", [](Model& m) { m.surface[0].position.z() = kNan; }},
      {"surface normal", [](Model& m) { m.surface[0].normal *= 2; }},
      {"pair point", [](Model& m) { m.pair_points[0].normal.setZero(); }},
      {"diameter", [](Model& m) { m.diameter = 0; }},
      {"infinite diameter", [](Model& m) { m.diameter = std::numeric_limits<double>::infinity(); }},
      {"box", [](Model& m) { m.box_max.y() = kNan; }},
      {"viewpoints", [](Model& m) { m.params.viewpoint_count = 1'000'000'000; }},
      {"bins", [](Model& m) { m.params.bin_width = 1e-9; }},
      {"lengths", [](Model& m) { m.params.pair_lengths.clear(); }},
      {"selection", [](Model& m) { m.params.selection = static_cast<PairSelection>(9); }},
      {"symmetry", [](Model& m) { m.symmetry.discrete.clear(); }},
  };
  for (const Wrong& wrong : cases) {
    Model spoilt = model();
    wrong.spoil(spoilt);
    EXPECT_EQ(parse_model(serialize_model(spoilt)).status().code(), absl::StatusCode::kDataLoss) << wrong.what;
  }
}

TEST(ModelFile, RefusesNumbersThatWouldPoisonTheSearch) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Wrong cases[] = {
      {"contour weight", [](Model& m) { m.contour_weights[0] = kNan; }},
      {"symmetry pose", [](Model& m) { m.symmetry.discrete[0].matrix()(0, 3) = kNan; }},
      {"symmetry axis", [](Model& m) { m.symmetry.axis_direction.x() = kNan; }},
      {"tiny diameter", [](Model& m) { m.diameter = 1e-30; }},
      {"far box", [](Model& m) { m.box_max.x() = 1e300; }},
      {"far point", [](Model& m) { m.pair_points[0].position.x() = 1e30F; }},
      {"great weight", [](Model& m) { m.pair_weights[0] = 1e38F; }},
      {"number of surface points",
       [](Model& m) {
         m.visibility.resize(70'000, m.visibility[0]);
         m.surface.resize(70'000, m.surface[0]);
       }},
  };
  for (const Wrong& wrong : cases) {
    Model spoilt = model();
    wrong.spoil(spoilt);
    EXPECT_FALSE(parse_model(serialize_model(spoilt)).ok()) << wrong.what;
  }
}

}  // namespace
}  // namespace binpose

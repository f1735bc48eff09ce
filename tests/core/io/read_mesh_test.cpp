#include "core/io/read_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"

namespace binpose {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Triangle = std::array<std::array<float, 3>, 3>;

template <typename Number>
void append_bytes(Number number, std::string& bytes) {
  std::array<char, sizeof(number)> raw{};
  std::memcpy(raw.data(), &number, raw.size());
  bytes.append(raw.data(), raw.size());
}

/// A tetrahedron with edges of 1 along the axes: four triangles on four vertices.
std::vector<Triangle> tetrahedron() {
  const std::array<float, 3> o = {0, 0, 0}, x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
  return {{o, y, x}, {o, x, z}, {x, y, z}, {y, o, z}};
}

std::string binary_stl(const std::vector<Triangle>& triangles, const std::string& header = "") {
  std::string bytes = header;
  bytes.resize(80, '\0');
  append_bytes(static_cast<std::uint32_t>(triangles.size()), bytes);
  for (const Triangle& triangle : triangles) {
    bytes.append(12, '\0');
    for (const auto& vertex : triangle) {
      for (const float coordinate : vertex) append_bytes(coordinate, bytes);
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

std::string ascii_stl(const std::vector<Triangle>& triangles) {
  std::string text = "solid made by a test\n";
  for (const Triangle& triangle : triangles) {
    absl::StrAppend(&text, "  facet normal 0 0 1\n    outer loop\n");
    for (const auto& v : triangle) absl::StrAppend(&text, "      vertex ", v[0], " ", v[1], " ", v[2], "\n");
    absl::StrAppend(&text, "    endloop\n  endfacet\n");
  }
  return text + "endsolid made by a test\n";
}

constexpr std::string_view kObj =
    "# a tetrahedron\nmtllib missing.mtl\no part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvn 0 0 1\nusemtl steel\n"
    "f 1 3 2\nf 1/1 2/1 4/1\nf 2/1/1 3/1/1 4/1/1\nf -2//1 -4//1 -1//1\n";

std::string ply_header(const std::string& format, int vertex_count, int face_count) {
  return absl::StrCat("ply\nformat ", format, " 1.0\ncomment made by a test\nelement vertex ", vertex_count,
                      "\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\nelement face ",
                      face_count, "\nproperty list uchar int vertex_indices\nend_header\n");
}

std::string ascii_ply() {
  return ply_header("ascii", 4, 4) + "0 0 0 255\n1 0 0 255\n0 1 0 255\n0 0 1 255\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
}

std::string binary_ply(bool is_big_endian) {
  std::string bytes = ply_header(is_big_endian ? "binary_big_endian" : "binary_little_endian", 4, 4);
  const auto append = [&](auto number) {
    std::string raw;
    append_bytes(number, raw);
    bytes += is_big_endian ? std::string(raw.rbegin(), raw.rend()) : raw;
  };
  for (const auto& v : {std::array{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
    append(static_cast<float>(v[0]));
    append(static_cast<float>(v[1]));
    append(static_cast<double>(v[2]));
    append(std::uint8_t{255});
  }
  for (const auto& face : {std::array{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
    append(std::uint8_t{3});
    for (const std::int32_t index : face) append(index);
  }
  return bytes;
}

absl::StatusOr<Mesh> read(const std::string& bytes, MeshFormat format = MeshFormat::kDetect) {
  return read_mesh(bytes, format, 1.0);
}

std::string refusal(const std::string& bytes, MeshFormat format = MeshFormat::kDetect) {
  const absl::StatusOr<Mesh> mesh = read(bytes, format);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(mesh.status().message());
}

/// Six times the signed volume of the tetrahedron: 1 when all corners and their order came through.
double six_volumes(const Mesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    sum += mesh.vertices[a].cross(mesh.vertices[b]).dot(mesh.vertices[c]);
  }
  return sum;
}

class EveryMeshFormat : public ::testing::TestWithParam<std::string> {};

TEST_P(EveryMeshFormat, GivesTheSameTetrahedronWithoutBeingTold) {
  const absl::StatusOr<Mesh> mesh = read(GetParam());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices.size(), 4u);
  EXPECT_EQ(mesh->triangles.size(), 4u);
  EXPECT_DOUBLE_EQ(six_volumes(*mesh), 1);
}

TEST_P(EveryMeshFormat, IsScaledToMetres) {
  const absl::StatusOr<Mesh> mesh = read_mesh(GetParam(), MeshFormat::kDetect, 0.001);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(six_volumes(*mesh), 1e-9, 1e-15);
}

TEST_P(EveryMeshFormat, IsRefusedOverTheTriangleLimit) {
  const absl::StatusOr<Mesh> mesh = read_mesh(GetParam(), MeshFormat::kDetect, 1, {.max_triangles = 3});
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(mesh.status().message()), HasSubstr("3"));
}

TEST_P(EveryMeshFormat, NeverCrashesWhenDamaged) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 3000; ++trial) {
    std::string bytes = GetParam();
    for (unsigned change = 0; change < 1 + random() % 5; ++change) {
      const std::size_t place = random() % bytes.size();
      if (random() % 3 == 0) {
        bytes.erase(place, random() % 9);
      } else if (random() % 3 == 0) {
        bytes.insert(place, bytes.substr(random() % bytes.size(), random() % 20));
      } else {
        bytes[place] = static_cast<char>(random() % 2 == 0 ? random() : "0123456789-. \n"[random() % 14]);
      }
      if (bytes.empty()) bytes.push_back('p');
    }
    const absl::StatusOr<Mesh> mesh = read(bytes);
    if (!mesh.ok()) continue;
    for (const auto& triangle : mesh->triangles) {
      for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh->vertices.size());
    }
    for (const Eigen::Vector3f& vertex : mesh->vertices) ASSERT_TRUE(vertex.allFinite());
  }
}

INSTANTIATE_TEST_SUITE_P(ReadMesh, EveryMeshFormat,
                         ::testing::Values(binary_stl(tetrahedron()), binary_stl(tetrahedron(), "solid of revolution"),
                                           ascii_stl(tetrahedron()), std::string(kObj), ascii_ply(), binary_ply(false),
                                           binary_ply(true)));

TEST(ReadMesh, RefusesNothingAtAll) { EXPECT_THAT(refusal(""), HasSubstr("0 bytes")); }

TEST(ReadMesh, RefusesWhatIsNoMeshAndShowsHowItBegins) {
  EXPECT_THAT(refusal("%PDF-1.7 whatever"), AllOf(HasSubstr("%PDF-1.7"), HasSubstr("neither STL, nor PLY, nor OBJ")));
}

TEST(ReadMesh, RefusesMoreBytesThanTheLimit) {
  const absl::StatusOr<Mesh> mesh = read_mesh(std::string(101, 'v'), MeshFormat::kObj, 1, {.max_bytes = 100});
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(mesh.status().message()), AllOf(HasSubstr("101 bytes"), HasSubstr("100")));
}

TEST(ReadMesh, RefusesATruncatedBinaryStlAndNamesTheMissingBytes) {
  std::string bytes = binary_stl(tetrahedron());
  bytes.resize(bytes.size() - 30);
  EXPECT_THAT(refusal(bytes), AllOf(HasSubstr("4 triangles"), HasSubstr("30 bytes are missing")));
}

TEST(ReadMesh, RefusesABinaryStlWithBytesToSpare) {
  EXPECT_THAT(refusal(binary_stl(tetrahedron()) + "tail"), HasSubstr("4 bytes are too many"));
}

TEST(ReadMesh, RefusesABinaryStlThatClaimsFourBillionTriangles) {
  std::string bytes = binary_stl(tetrahedron());
  std::memset(bytes.data() + 80, 0xff, 4);
  EXPECT_THAT(refusal(bytes, MeshFormat::kStl), AllOf(HasSubstr("4294967295 triangles"), HasSubstr("missing")));
}

TEST(ReadMesh, RefusesATruncatedAsciiStl) {
  const std::string text = ascii_stl(tetrahedron());
  EXPECT_THAT(refusal(text.substr(0, text.find("endsolid"))), HasSubstr("truncated"));
  EXPECT_THAT(refusal(text.substr(0, text.size() / 2)), HasSubstr("ASCII STL"));
}

TEST(ReadMesh, RefusesAnAsciiStlWithAWordOutOfPlace) {
  std::string text = ascii_stl(tetrahedron());
  text.replace(text.find("endloop"), 7, "vertex ");
  EXPECT_THAT(refusal(text), AllOf(HasSubstr("\"vertex\""), HasSubstr("\"endloop\"")));
}

TEST(ReadMesh, TakesSeveralSolidsAndCapitalsInAsciiStl) {
  const std::string solids =
      "SOLID A\nFACET NORMAL 0 0 0\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 0\nENDLOOP\n"
      "ENDFACET\nENDSOLID\n" +
      ascii_stl(tetrahedron());
  const absl::StatusOr<Mesh> mesh = read(solids);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->triangles.size(), 5u);
  EXPECT_EQ(mesh->vertices.size(), 4u);
}

TEST(ReadMesh, RefusesAMeshWithoutFaces) {
  EXPECT_THAT(refusal(binary_stl({})), HasSubstr("no face"));
  EXPECT_THAT(refusal("solid empty\nendsolid empty\n"), HasSubstr("no face"));
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\n"), HasSubstr("no face"));
}

TEST(ReadMesh, RefusesACoordinateThatIsNotFiniteAndNamesVertexAndValue) {
  std::vector<Triangle> triangles = tetrahedron();
  triangles[1][2][0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal(binary_stl(triangles)), AllOf(HasSubstr("Vertex 5"), HasSubstr("nan")));
  triangles[1][2][0] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(refusal(binary_stl(triangles)), AllOf(HasSubstr("Vertex 5"), HasSubstr("inf")));
  EXPECT_THAT(refusal("v 0 0 0\nv 1e60 0 0\nv 0 1 0\nf 1 2 3\n"), AllOf(HasSubstr("Vertex 1"), HasSubstr("inf")));
}

TEST(ReadMesh, TakesNumbersTooSmallForAFloatAsZero) {
  EXPECT_TRUE(read("v 0 0 1e-60\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").ok());
}

TEST(ReadMesh, RefusesAnIndexOutOfRange) {
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
              AllOf(HasSubstr("Line 4"), HasSubstr("\"4\""), HasSubstr("3 vertices")));
  EXPECT_THAT(refusal("v 0 0 0\nf 1 1 0\n"), HasSubstr("\"0\""));
  EXPECT_THAT(refusal("v 0 0 0\nf 1 1 -2\n"), HasSubstr("\"-2\""));
  EXPECT_THAT(refusal("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"), AllOf(HasSubstr("Line 1"), HasSubstr("0 vertices")));
  EXPECT_THAT(refusal(ply_header("ascii", 1, 1) + "0 0 0 0\n3 0 0 7\n"),
              AllOf(HasSubstr("vertex 7"), HasSubstr("1 vertices")));
  EXPECT_THAT(refusal(ply_header("ascii", 1, 1) + "0 0 0 0\n3 0 0 -1\n"), HasSubstr("-1"));
}

TEST(ReadMesh, RefusesAFaceOfTwoCorners) {
  EXPECT_THAT(refusal("v 0 0 0\nv 1 0 0\nf 1 2\n"), AllOf(HasSubstr("2 corners"), HasSubstr("at least 3")));
}

TEST(ReadMesh, RefusesAFaceOfTooManyCorners) {
  std::string face("f");
  for (int i = 0; i < 256; ++i) face += " 1";
  EXPECT_THAT(refusal("v 0 0 0\n" + face + "\n"), HasSubstr("255"));
}

TEST(ReadMesh, RefusesATruncatedPly) {
  const std::string text = ascii_ply();
  EXPECT_THAT(refusal(text.substr(0, text.size() - 4)), HasSubstr("truncated"));
  const std::string binary = binary_ply(false);
  EXPECT_THAT(refusal(binary.substr(0, binary.size() - 1)), AllOf(HasSubstr("truncated"), HasSubstr("4 rows")));
  EXPECT_THAT(refusal(text.substr(0, 40)), HasSubstr("end_header"));
}

TEST(ReadMesh, RefusesAPlyThatClaimsMoreRowsThanItHasBytes) {
  EXPECT_THAT(refusal(ply_header("binary_little_endian", 2000000000, 1)),
              AllOf(HasSubstr("2000000000 rows"), HasSubstr("0 bytes")));
}

TEST(ReadMesh, RefusesAPlyElementWithRowsButNoColumns) {
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nelement ghost 4000000000\nend_header\n"), HasSubstr("ghost"));
}

TEST(ReadMesh, RefusesAPlyHeaderLineThatMakesNoSense) {
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nelement vertex many\nend_header\n"),
              AllOf(HasSubstr("Line 3"), HasSubstr("element vertex many")));
  EXPECT_THAT(refusal("ply\nformat ebcdic 1.0\nend_header\n"), HasSubstr("Line 2"));
}

TEST(ReadMesh, CutsAConvexPolygonIntoTriangles) {
  const absl::StatusOr<Mesh> mesh = read("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->triangles.size(), 3u);
}

TEST(ReadMesh, CutsADartFromItsInnerCorner) {
  const absl::StatusOr<Mesh> mesh = read("v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 1 2 3 4\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  for (const auto& [a, b, c] : mesh->triangles) {
    const Eigen::Vector3f normal = (mesh->vertices[b] - mesh->vertices[a]).cross(mesh->vertices[c] - mesh->vertices[a]);
    EXPECT_GT(normal.z(), 0);
  }
}

TEST(ReadMesh, RefusesAPolygonThatNoFanFills) {
  EXPECT_THAT(refusal("v 0 0 0\nv 3 0 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf 1 2 3 4 5 6 7 8\n"),
              AllOf(HasSubstr("concave"), HasSubstr("8 corners"), HasSubstr("triangles")));
}

TEST(ReadMesh, MergesEqualVerticesAndDropsUnusedOnes) {
  const absl::StatusOr<Mesh> mesh = read("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv -0 0 -0\nf 2 3 4\nf 5 4 3\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices.size(), 3u);
  EXPECT_THAT(mesh->triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 1)));
}

TEST(ReadMesh, KeepsTrianglesWithoutArea) {
  const absl::StatusOr<Mesh> mesh = read("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 1\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->triangles.size(), 2u);
}

/// A text file of many equal rows and damaged at its end, which a reader that has been stopped does not reach.
struct LongFile {
  std::string before;
  std::string row;
};

TEST(ReadMesh, EndsSoonAfterItsCallerHasGone) {
  const LongFile files[] = {
      {"", "v 1 2 3\n"},
      {"solid\n", "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n"},
      {ply_header("ascii", 3000, 1), "1 2 3\n"}};
  std::stop_source stop;
  stop.request_stop();
  for (const LongFile& file : files) {
    std::string bytes = file.before;
    for (int i = 0; i < 2000; ++i) bytes += file.row;
    bytes += "v damaged";
    const auto code = [&](const RunControl& control) {
      return read_mesh(bytes, MeshFormat::kDetect, 1, {}, control).status().code();
    };
    EXPECT_EQ(code({}), absl::StatusCode::kInvalidArgument) << file.row;
    EXPECT_EQ(code({.stop = stop.get_token()}), absl::StatusCode::kCancelled) << file.row;
  }
}

TEST(ReadMesh, TakesWindowsLineEnds) {
  EXPECT_TRUE(read("v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n").ok());
  EXPECT_TRUE(read("ply\r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty float x\r\nproperty float y\r\n"
                   "property float z\r\nelement face 1\r\nproperty list uchar int vertex_index\r\nend_header\r\n"
                   "0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2\r\n")
                  .ok());
}

}  // namespace
}  // namespace binpose

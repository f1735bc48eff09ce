#include "core/io/model_file.h"

#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "absl/strings/escaping.h"
#include "absl/strings/str_format.h"

namespace binpose {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are stored as they lie in memory");

constexpr std::string_view kMagic = "binpose\n";
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHeaderBytes = kMagic.size() + sizeof(std::uint32_t) + sizeof(std::uint64_t);
constexpr std::size_t kMostListed = 1U << 20;  // entries of a list; far above what training produces

using Digest = std::array<unsigned char, SHA256_DIGEST_LENGTH>;

Digest sha256(std::string_view bytes) {
  Digest digest;
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  return digest;
}

/// Appends values to a string of bytes.
class Writer {
 public:
  template <typename T>
  void number(T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  /// Length of a list, then room for the caller to visit its entries.
  template <typename List>
  void length(List& list) {
    auto count = static_cast<std::uint32_t>(list.size());
    number(count);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Takes values from bytes; after the end every value is zero and ok() is false.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  template <typename T>
  void number(T& value) {
    value = T{};
    ok_ = ok_ && bytes_.size() >= sizeof(value);
    if (!ok_) return;
    std::memcpy(&value, bytes_.data(), sizeof(value));
    bytes_.remove_prefix(sizeof(value));
  }
  /// Makes room for as many entries as the length says, unless the bytes that are left can't hold them.
  template <typename List>
  void length(List& list) {
    std::uint32_t count = 0;
    number(count);
    ok_ = ok_ && count <= std::min(kMostListed, bytes_.size());
    list.resize(ok_ ? count : 0);
  }
  bool ok() const { return ok_; }
  bool at_end() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
  bool ok_ = true;
};

// One visit function per type serves both directions, so that what is written and what is read can't drift apart.

template <typename Archive, typename Derived>
void visit(Archive& archive, Eigen::MatrixBase<Derived>& matrix) {
  for (Eigen::Index c = 0; c < matrix.cols(); ++c) {
    for (Eigen::Index r = 0; r < matrix.rows(); ++r) archive.number(matrix(r, c));
  }
}

template <typename Archive>
void visit(Archive& archive, std::string& text) {
  archive.length(text);
  for (char& c : text) archive.number(c);
}

template <typename Archive>
void visit(Archive& archive, Pose& pose) {
  for (int i = 0; i < 12; ++i) archive.number(pose.matrix()(i / 4, i % 4));
}

template <typename Archive>
void visit(Archive& archive, std::vector<SurfacePoint>& points) {
  archive.length(points);
  for (SurfacePoint& point : points) {
    visit(archive, point.position);
    visit(archive, point.normal);
  }
}

template <typename Archive>
void visit(Archive& archive, std::vector<ContourPoint>& contours) {
  archive.length(contours);
  for (ContourPoint& contour : contours) {
    visit(archive, contour.position);
    visit(archive, contour.normal);
    visit(archive, contour.outward);
  }
}

template <typename Archive>
void visit(Archive& archive, TrainParams& params) {
  archive.number(params.relative_sampling);
  archive.length(params.pair_lengths);
  for (PairLengths& lengths : params.pair_lengths) {
    archive.number(lengths.relative_q1);
    archive.number(lengths.relative_q2);
  }
  archive.number(params.relative_length_tolerance);
  archive.number(params.bin_width);
  archive.number(params.viewpoint_count);
  auto selection = static_cast<std::int32_t>(params.selection);
  archive.number(selection);
  params.selection = static_cast<PairSelection>(selection);
  archive.number(params.pairs_per_point);
  archive.number(params.observability_weight);
  archive.number(params.distinctiveness_weight);
}

template <typename Archive>
void visit(Archive& archive, Symmetry& symmetry) {
  archive.length(symmetry.discrete);
  for (Pose& pose : symmetry.discrete) visit(archive, pose);
  auto has_axis = static_cast<std::uint8_t>(symmetry.has_axis);
  archive.number(has_axis);
  symmetry.has_axis = has_axis != 0;
  visit(archive, symmetry.axis_point);
  visit(archive, symmetry.axis_direction);
}

template <typename Archive>
void visit_masks(Archive& archive, std::vector<ViewMask>& masks, const TrainParams& params) {
  archive.length(masks);
  const int words = (std::clamp(params.viewpoint_count, 0, 4096) + 63) / 64;
  for (ViewMask& mask : masks) {
    mask.resize(words);
    for (std::uint64_t& word : mask) archive.number(word);
  }
}

template <typename Archive>
void visit(Archive& archive, Model& model) {
  visit(archive, model.params);
  archive.number(model.diameter);
  visit(archive, model.box_min);
  visit(archive, model.box_max);
  visit(archive, model.surface);
  visit_masks(archive, model.visibility, model.params);
  archive.length(model.outlines);
  for (std::vector<ContourPoint>& outline : model.outlines) visit(archive, outline);
  visit(archive, model.pair_points);
  archive.length(model.pairs);
  for (VectorPair& pair : model.pairs) archive.number(pair);
  archive.length(model.pair_weights);
  for (float& weight : model.pair_weights) archive.number(weight);
  visit(archive, model.contour_points);
  archive.length(model.contour_pairs);
  for (ContourPair& pair : model.contour_pairs) archive.number(pair);
  archive.length(model.contour_weights);
  for (float& weight : model.contour_weights) archive.number(weight);
  visit(archive, model.symmetry);
  archive.length(model.similar_poses);
  for (Pose& pose : model.similar_poses) visit(archive, pose);
  visit(archive, model.telling_points);
  archive.number(model.telling_spacing);
  visit_masks(archive, model.telling_visibility, model.params);
  archive.length(model.warnings);
  for (std::string& warning : model.warnings) visit(archive, warning);
}

std::string payload_of(const Model& model) {
  Writer writer;
  visit(writer, const_cast<Model&>(model));  // a Writer changes nothing
  return writer.bytes();
}

/// False for what is not a number, too.
bool bounded(double number) { return std::abs(number) <= kLargestCoordinate; }

template <typename Derived>
bool bounded(const Eigen::MatrixBase<Derived>& matrix) {
  return matrix.unaryExpr([](double number) { return bounded(number); }).all();
}

bool sound(const std::vector<SurfacePoint>& points) {
  return points.size() <= 65535 && std::all_of(points.begin(), points.end(), [](const SurfacePoint& p) {
           return bounded(p.position) && std::abs(p.normal.norm() - 1) < 1e-3;
         });
}

bool sound(const std::vector<ContourPoint>& contours) {
  return std::all_of(contours.begin(), contours.end(), [](const ContourPoint& c) {
    return bounded(c.position) && bounded(c.normal) && bounded(c.outward);
  });
}

bool sound(const std::vector<std::vector<ContourPoint>>& outlines) {
  return std::all_of(outlines.begin(), outlines.end(),
                     [](const std::vector<ContourPoint>& outline) { return sound(outline); });
}

bool sound(const std::vector<float>& weights) {
  return std::all_of(weights.begin(), weights.end(), [](float weight) { return bounded(weight) && weight >= 0; });
}

bool sound(const std::vector<Pose>& poses) {
  return std::all_of(poses.begin(), poses.end(), [](const Pose& pose) { return bounded(pose.matrix()); });
}

bool sound(const Symmetry& symmetry) {
  return !symmetry.discrete.empty() && bounded(symmetry.axis_point) && bounded(symmetry.axis_direction) &&
         sound(symmetry.discrete);
}

/// What derive() and detection rely on.
bool invariants_hold(const Model& model) {
  const std::size_t points = model.pair_points.size(), scales = model.params.pair_lengths.size();
  return validate(model.params).ok() && model.params.selection >= PairSelection::kDistinctiveness &&
         model.params.selection <= PairSelection::kSignalToNoise && model.diameter >= kSmallestDiameter &&
         model.diameter <= kLargestDiameter && bounded(model.box_min) && bounded(model.box_max) &&
         sound(model.surface) && sound(model.pair_points) && model.visibility.size() == model.surface.size() &&
         model.outlines.size() == static_cast<std::size_t>(model.params.viewpoint_count) && sound(model.outlines) &&
         sound(model.contour_points) && model.contour_points.size() <= 65535 &&
         model.contour_weights.size() == model.contour_pairs.size() &&
         std::all_of(model.contour_pairs.begin(), model.contour_pairs.end(),
                     [&](const ContourPair& pair) {
                       return pair.a < model.contour_points.size() && pair.b < model.contour_points.size() &&
                              pair.a != pair.b;
                     }) &&
         model.pair_weights.size() == model.pairs.size() && sound(model.pair_weights) && sound(model.contour_weights) &&
         sound(model.symmetry) && sound(model.similar_poses) && sound(model.telling_points) &&
         bounded(model.telling_spacing) && model.telling_visibility.size() == model.telling_points.size() &&
         std::all_of(model.pairs.begin(), model.pairs.end(), [&](const VectorPair& pair) {
           return pair.p < points && pair.q1 < points && pair.q2 < points && pair.p != pair.q1 && pair.p != pair.q2 &&
                  pair.q1 != pair.q2 && pair.scale < scales;
         });
}

}  // namespace

std::string serialize_model(const Model& model) {
  const std::string payload = payload_of(model);
  const Digest digest = sha256(payload);
  Writer header;
  std::uint32_t version = kVersion;
  std::uint64_t size = payload.size();
  header.number(version);
  header.number(size);
  std::string bytes(kMagic);
  bytes += header.bytes();
  bytes += payload;
  bytes.append(reinterpret_cast<const char*>(digest.data()), digest.size());
  return bytes;
}

absl::StatusOr<Model> parse_model(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes || bytes.substr(0, kMagic.size()) != kMagic) {
    return absl::DataLossError("not a binpose model: it does not begin with the format's magic number.");
  }
  Reader header(bytes.substr(kMagic.size(), kHeaderBytes - kMagic.size()));
  std::uint32_t version = 0;
  std::uint64_t size = 0;
  header.number(version);
  header.number(size);
  if (version != kVersion) {
    return absl::UnimplementedError(absl::StrFormat(
        "model format version is %d; this program reads version %d. Train the part again.", version, kVersion));
  }
  const std::size_t left = bytes.size() - kHeaderBytes;
  if (left < SHA256_DIGEST_LENGTH || size != left - SHA256_DIGEST_LENGTH) {
    return absl::DataLossError(
        absl::StrFormat("model has %d bytes after its header; it states a payload of %d and a checksum of %d.", left,
                        size, SHA256_DIGEST_LENGTH));
  }
  const std::string_view payload = bytes.substr(kHeaderBytes, size);
  const Digest digest = sha256(payload);
  if (std::memcmp(digest.data(), payload.data() + payload.size(), digest.size()) != 0) {
    return absl::DataLossError("model has a wrong checksum: the file is damaged.");
  }
  Reader reader(payload);
  Model model;
  visit(reader, model);
  if (!reader.ok() || !reader.at_end() || !invariants_hold(model)) {
    return absl::DataLossError("model contradicts itself: a length, index or number is out of its range.");
  }
  derive(model);
  return model;
}

std::string content_hash(const Model& model) {
  const Digest digest = sha256(payload_of(model));
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

}  // namespace binpose

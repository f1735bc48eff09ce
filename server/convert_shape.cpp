#include "server/convert_shape.h"

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "core/train/visibility.h"

namespace binpose::server {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers go over the wire as they lie in memory");

template <typename Number>
void append(Number number, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void append(const Eigen::Vector3f& vector, std::string& bytes) {
  for (const float coordinate : vector) append(coordinate, bytes);
}

/// The pairs of all lengths in one row: the best of each, then the second of each.
std::vector<VectorPair> best_first(const Model& model) {
  std::vector<std::vector<VectorPair>> by_scale(model.params.pair_lengths.size());
  for (const VectorPair& pair : model.pairs) by_scale[pair.scale].push_back(pair);
  std::vector<VectorPair> row;
  for (std::size_t rank = 0; row.size() < model.pairs.size(); ++rank) {
    for (const std::vector<VectorPair>& pairs : by_scale) {
      if (rank < pairs.size()) row.push_back(pairs[rank]);
    }
  }
  return row;
}

}  // namespace

v1::GetModelShapeResponse shape_of(const Model& model) {
  v1::GetModelShapeResponse shape;
  for (const SurfacePoint& point : model.surface) {
    append(point.position, *shape.mutable_surface());
    append(point.normal, *shape.mutable_normals());
  }
  for (const ViewMask& views : model.visibility) {
    append(static_cast<float>(observability(views, model.params.viewpoint_count)), *shape.mutable_observability());
  }
  for (const SurfacePoint& point : model.pair_points) append(point.position, *shape.mutable_pair_points());
  for (const VectorPair& pair : best_first(model)) {
    for (const std::uint32_t index : {pair.p, pair.q1, pair.q2}) append(index, *shape.mutable_pairs());
  }
  return shape;
}

}  // namespace binpose::server

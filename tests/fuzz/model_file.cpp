// Bytes as a model file; and as what lies inside its envelope and its checksums, which these would hide from the
// fuzzer: whoever may import models can compute checksums too. What is taken for a model is searched for.
#include "core/io/model_file.h"

#include <openssl/sha.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "core/detect/detect.h"
#include "server/model_envelope.h"

namespace {

/// The payload as serialize_model() would seal it; `like` gives the format's first bytes.
std::string sealed(std::string_view payload, std::string_view like) {
  constexpr std::size_t kMagicAndVersion = 12;
  const std::uint64_t size = payload.size();
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(payload.data()), payload.size(), digest.data());
  std::string bytes(like.substr(0, kMagicAndVersion));
  bytes.append(reinterpret_cast<const char*>(&size), sizeof(size));
  bytes += payload;
  bytes.append(reinterpret_cast<const char*>(digest.data()), digest.size());
  return bytes;
}

/// A bulging sheet half a metre before the sensor.
binpose::PointCloud scan() {
  binpose::PointCloud cloud;
  cloud.width = cloud.height = 24;
  for (int v = 0; v < 24; ++v) {
    for (int u = 0; u < 24; ++u) {
      const float x = 0.002F * static_cast<float>(u - 12), y = 0.002F * static_cast<float>(v - 12);
      cloud.points.emplace_back(x, y, 0.5F + 4 * (x * x + y * y));
    }
  }
  return cloud;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  static_cast<void>(binpose::server::open_envelope("id", bytes));
  static const binpose::Model empty;
  static const std::string real = binpose::serialize_model(empty);
  const auto model = binpose::parse_model(sealed(bytes, real));
  if (!model.ok()) return 0;
  if (!binpose::parse_model(binpose::serialize_model(*model)).ok()) std::abort();
  static const binpose::PointCloud cloud = scan();
  const binpose::Model* const models[] = {&*model};
  static_cast<void>(binpose::detect(cloud, models, {}, {}));
  return 0;
}

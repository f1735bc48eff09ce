// Bytes as the files of a cloud, PCD and PLY, through all checks of the service.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "server/convert_cloud.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace binpose;  // NOLINT
  v1::PointCloud message;
  message.set_unit(v1::LENGTH_UNIT_MILLIMETRE);
  message.set_pcd(data, size);
  for (int format = 0; format < 2; ++format) {
    const auto cloud = server::to_cloud(message);
    if (cloud.ok() && cloud->points.size() > server::kMaxCloudPoints) std::abort();
    message.set_ply(data, size);
  }
  return 0;
}

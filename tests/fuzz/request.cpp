// Bytes as a frame of a Detect stream: its ID is read, it is decoded, and parameters and cloud are converted.
#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "binpose/v1/detection_service.pb.h"
#include "server/convert_cloud.h"
#include "server/convert_detection.h"
#include "server/detection_limits.h"
#include "server/frame_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace binpose;  // NOLINT
  const grpc::Slice slice(data, size);
  grpc::ByteBuffer bytes(&slice, 1);
  if (server::request_id_of(bytes).size() > server::kMaxRequestIdBytes) std::abort();
  v1::DetectRequest request;
  if (!server::decode(bytes, request)) return 0;
  static_cast<void>(server::to_detect_params(request.params(), request.model_ids(), 0.001));
  static_cast<void>(server::to_cloud(request.cloud()));
  return 0;
}

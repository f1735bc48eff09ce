#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <memory>

#include "binpose/v1/detection_service.pb.h"

namespace binpose::client {

/// A scan that lives as long as somebody needs it.
using Scan = std::shared_ptr<const v1::DetectRequest>;

/// The scan as it goes over the wire. Its cloud is not copied: the bytes hold on to the scan until they are sent.
/// Not Valid() for a scan of more than 2 GiB, which protobuf cannot encode.
grpc::ByteBuffer encode(const Scan& scan);

}  // namespace binpose::client

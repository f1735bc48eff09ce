#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/support/byte_buffer.h>

#include <string>

namespace binpose::server {

/// Whether `bytes` decode to `message`; they are released then.
bool decode(grpc::ByteBuffer& bytes, google::protobuf::MessageLite& message);

grpc::ByteBuffer encode(const google::protobuf::MessageLite& message);

/// The request_id at the start of an encoded DetectRequest, where encoders put it; empty when it is not there, too long
/// or no text. Reads nothing beyond it.
std::string request_id_of(grpc::ByteBuffer& bytes);

}  // namespace binpose::server

#include "server/frame_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include "binpose/v1/detection_service.pb.h"
#include "server/detection_limits.h"

namespace binpose::server {

bool decode(grpc::ByteBuffer& bytes, google::protobuf::MessageLite& message) {
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok() || !message.ParseFromZeroCopyStream(&reader)) return false;
  bytes.Clear();
  return true;
}

grpc::ByteBuffer encode(const google::protobuf::MessageLite& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return {&slice, 1};
}

std::string request_id_of(grpc::ByteBuffer& bytes) {
  using google::protobuf::internal::WireFormatLite;
  constexpr std::uint32_t kTag =
      WireFormatLite::MakeTag(v1::DetectRequest::kRequestIdFieldNumber, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok()) return "";
  google::protobuf::io::CodedInputStream input(&reader);
  std::string id;
  std::uint32_t size = 0;
  const bool found = input.ReadTag() == kTag && input.ReadVarint32(&size) && size <= kMaxRequestIdBytes &&
                     input.ReadString(&id, static_cast<int>(size));
  const bool is_text =
      WireFormatLite::VerifyUtf8String(id.data(), static_cast<int>(id.size()), WireFormatLite::PARSE, "request_id");
  return found && is_text ? id : "";
}

}  // namespace binpose::server

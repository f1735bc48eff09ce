#include "client/encode_scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace binpose::client {
namespace {

/// A scan with large and small fields, one behind the other.
Scan full_scan() {
  v1::DetectRequest request;
  request.set_request_id(std::string(5000, 'x'));  // more than one buffer takes
  for (int i = 0; i < 300; ++i) request.add_model_ids("model " + std::to_string(i));
  request.mutable_cloud()->set_unit(v1::LENGTH_UNIT_MILLIMETRE);
  request.mutable_cloud()->mutable_points()->set_xyz(std::string(1 << 20, 'p'));
  request.mutable_cloud()->mutable_points()->set_normals(std::string(1 << 20, 'n'));
  request.mutable_params()->set_min_score(0.5);
  request.set_time_budget_seconds(1);
  return std::make_shared<const v1::DetectRequest>(std::move(request));
}

std::vector<grpc::Slice> slices_of(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(bytes.Dump(&slices).ok());
  return slices;
}

TEST(EncodeScan, GivesTheBytesOfProtobuf) {
  for (const Scan& scan : {full_scan(), std::make_shared<const v1::DetectRequest>()}) {
    const grpc::ByteBuffer bytes = encode(scan);
    ASSERT_TRUE(bytes.Valid());
    std::string text;
    for (const grpc::Slice& slice : slices_of(bytes)) text.append(slice.begin(), slice.end());
    EXPECT_TRUE(text == scan->SerializeAsString());
  }
}

TEST(EncodeScan, CopiesNoCloud) {
  const Scan scan = full_scan();
  const std::string& xyz = scan->cloud().points().xyz();
  const std::vector<grpc::Slice> slices = slices_of(encode(scan));
  EXPECT_TRUE(std::any_of(slices.begin(), slices.end(), [&](const grpc::Slice& slice) {
    return static_cast<const void*>(slice.begin()) == xyz.data() && slice.size() == xyz.size();
  }));
}

TEST(EncodeScan, KeepsTheScanAsLongAsItsBytes) {
  Scan scan = full_scan();
  const std::weak_ptr<const v1::DetectRequest> watched = scan;
  grpc::ByteBuffer bytes = encode(scan);
  scan.reset();
  EXPECT_FALSE(watched.expired());
  bytes.Clear();
  EXPECT_TRUE(watched.expired());
}

}  // namespace
}  // namespace binpose::client

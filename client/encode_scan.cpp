#include "client/encode_scan.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace binpose::client {
namespace {

/// Collects what is encoded: small fields in buffers of its own, large ones where they lie in the scan.
class SliceOutput final : public google::protobuf::io::ZeroCopyOutputStream {
 public:
  explicit SliceOutput(const Scan& scan) : scan_(scan) {}

  bool Next(void** data, int* size) override {
    constexpr std::size_t kBufferBytes = 4096;
    const grpc::Slice& buffer = slices_.emplace_back(kBufferBytes);
    *data = const_cast<std::uint8_t*>(buffer.begin());  // NOLINT(*-const-cast): nobody else has it yet
    *size = static_cast<int>(kBufferBytes);
    bytes_ += *size;
    return true;
  }
  void BackUp(int count) override {
    slices_.back() = slices_.back().sub(0, slices_.back().size() - static_cast<std::size_t>(count));
    bytes_ -= count;
  }
  std::int64_t ByteCount() const override { return bytes_; }
  bool AllowsAliasing() const override { return true; }
  bool WriteAliasedRaw(const void* data, int size) override {
    const auto let_go = [](void* scan) { delete static_cast<Scan*>(scan); };
    slices_.emplace_back(const_cast<void*>(data), static_cast<std::size_t>(size), let_go,  // NOLINT(*-const-cast)
                         new Scan(scan_));
    bytes_ += size;
    return true;
  }

  const std::vector<grpc::Slice>& slices() const { return slices_; }

 private:
  const Scan& scan_;
  std::vector<grpc::Slice> slices_;
  std::int64_t bytes_ = 0;
};

}  // namespace

grpc::ByteBuffer encode(const Scan& scan) {
  SliceOutput output(scan);
  {
    google::protobuf::io::CodedOutputStream coded(&output);
    coded.EnableAliasing(true);
    if (!scan->SerializeToCodedStream(&coded)) return {};
  }  // here the rest of the last buffer is given back
  return {output.slices().data(), output.slices().size()};
}

}  // namespace binpose::client

#include "server/model_envelope.h"

#include <openssl/sha.h>

#include <array>
#include <bit>
#include <cstring>
#include <type_traits>

#include "absl/strings/str_format.h"
#include "core/io/model_file.h"

namespace binpose::server {
namespace {

constexpr std::uint32_t kVersion = 1;

/// Start of a model file, little endian.
struct Header {
  std::array<char, 8> magic = {'b', 'p', 's', 't', 'o', 'r', 'e', '\n'};
  std::uint32_t version = kVersion;
  std::uint32_t generation = 0;
  std::int64_t create_time = 0;  // seconds since 1970
  std::uint64_t payload_bytes = 0;
};
static_assert(std::has_unique_object_representations_v<Header> && sizeof(Header) == 32);
static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kPayloadStart = sizeof(Header) + SHA256_DIGEST_LENGTH;

std::string as_bytes(const Header& header) { return {reinterpret_cast<const char*>(&header), sizeof(header)}; }

std::string checksum(const Header& header, std::string_view payload) {
  const std::string covered = as_bytes(header).append(payload);
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(covered.data()), covered.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

/// OK when `header` and the file's size are those of a model file of this version.
absl::Status check_header(const Header& header, std::size_t file_bytes) {
  if (header.magic != Header().magic) return absl::DataLossError("It is no model file.");
  if (header.version != kVersion) {
    return absl::UnimplementedError(
        absl::StrFormat("It has format version %d; this server reads %d.", header.version, kVersion));
  }
  if (header.payload_bytes != file_bytes - kPayloadStart) {
    return absl::DataLossError(absl::StrFormat("It holds %d bytes of model; its header says %d.",
                                               file_bytes - kPayloadStart, header.payload_bytes));
  }
  return absl::OkStatus();
}

}  // namespace

std::string seal_envelope(const StoredModel& stored) {
  const std::string payload = serialize_model(stored.model);
  Header header;
  header.generation = stored.generation;
  header.create_time = stored.create_time.time_since_epoch().count();
  header.payload_bytes = payload.size();
  return as_bytes(header) + checksum(header, payload) + payload;
}

absl::StatusOr<StoredModel> open_envelope(std::string_view id, std::string_view bytes) {
  if (bytes.size() < kPayloadStart) {
    return absl::DataLossError(
        absl::StrFormat("It has %d bytes; a model file has at least %d.", bytes.size(), kPayloadStart));
  }
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  const absl::Status header_status = check_header(header, bytes.size());
  if (!header_status.ok()) return header_status;
  const std::string_view payload = bytes.substr(kPayloadStart);
  if (checksum(header, payload) != bytes.substr(sizeof(header), SHA256_DIGEST_LENGTH)) {
    return absl::DataLossError("Its checksum is wrong.");
  }
  absl::StatusOr<Model> model = parse_model(payload);
  if (!model.ok()) return model.status();
  StoredModel stored;
  stored.id = std::string(id);
  stored.generation = header.generation;
  stored.create_time = std::chrono::sys_seconds(std::chrono::seconds(header.create_time));
  stored.content_hash = content_hash(*model);
  stored.file_bytes = bytes.size();
  stored.model = *std::move(model);
  return stored;
}

}  // namespace binpose::server

// Bytes as a model file, and as the model inside it, which its checksum would else hide from the fuzzer.
#include "core/io/model_file.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "server/model_envelope.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  static_cast<void>(binpose::server::open_envelope("id", bytes));
  static_cast<void>(binpose::parse_model(bytes));
  return 0;
}

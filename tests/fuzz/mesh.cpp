// Bytes as a mesh file of any format: read_mesh() must refuse or read them, and what it reads must be a mesh.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/io/read_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  for (const auto format : {binpose::MeshFormat::kDetect, binpose::MeshFormat::kStl, binpose::MeshFormat::kPly,
                            binpose::MeshFormat::kObj}) {
    const auto mesh = binpose::read_mesh(bytes, format, 0.001);
    if (!mesh.ok() && mesh.status().message().empty()) std::abort();
  }
  return 0;
}

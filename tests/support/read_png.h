#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace binpose::testing {

/// The pixels of a 16-bit grey PNG, row by row. Throws std::runtime_error unless it has `count` of them.
std::vector<std::uint16_t> read_png16(const std::filesystem::path& path, std::size_t count);

}  // namespace binpose::testing

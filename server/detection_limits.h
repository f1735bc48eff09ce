#pragma once

#include <cstddef>

namespace binpose::server {

inline constexpr std::size_t kMaxRequestIdBytes = 256;
inline constexpr int kMaxModelsPerRequest = 16;

}  // namespace binpose::server

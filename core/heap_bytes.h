#pragma once

#include <cstddef>
#include <vector>

namespace binpose {

/// What a vector holds outside itself, in vectors in it as well.
template <class Value>
std::size_t heap_bytes(const std::vector<Value>& values) {
  return values.capacity() * sizeof(Value);
}

template <class Value>
std::size_t heap_bytes(const std::vector<std::vector<Value>>& values) {
  std::size_t bytes = values.capacity() * sizeof(std::vector<Value>);
  for (const std::vector<Value>& inner : values) bytes += heap_bytes(inner);
  return bytes;
}

}  // namespace binpose

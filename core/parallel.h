#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

namespace binpose {

/// Runs `body(i)` for i in [0, count), on at most `threads` threads (1 = on the caller's alone). The order is free, so
/// that results stay the same on any number of threads only if each i writes to a place of its own.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

/// The same for small steps: `block` of them follow each other on one thread.
template <typename Body>
void parallel_for_blocks(std::size_t count, std::size_t block, int threads, Body&& body) {
  parallel_for(static_cast<int>((count + block - 1) / block), threads, [&](int b) {
    const std::size_t first = static_cast<std::size_t>(b) * block;
    for (std::size_t i = first; i < std::min(count, first + block); ++i) body(i);
  });
}

}  // namespace binpose

#pragma once

#include <functional>

namespace binpose {

/// Runs `body(i)` for i in [0, count), on at most `threads` threads (1 = on the caller's alone). The order is free, so
/// that results stay the same on any number of threads only if each i writes to a place of its own.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

}  // namespace binpose

#include "core/parallel.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace binpose {

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
  if (threads <= 1 || count <= 1) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  tbb::task_arena arena(threads);
  arena.execute([&] { tbb::parallel_for(0, count, body); });
}

}  // namespace binpose

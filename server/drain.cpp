#include "server/drain.h"

namespace binpose::server {

bool Drain::wait_for_calls(std::chrono::seconds timeout) {
  std::unique_lock lock(mutex_);
  return none_left_.wait_for(lock, timeout, [this] { return calls_ == 0; });
}

void Drain::add(int calls) {
  const std::lock_guard lock(mutex_);
  calls_ += calls;
  if (calls_ == 0) none_left_.notify_all();
}

}  // namespace binpose::server

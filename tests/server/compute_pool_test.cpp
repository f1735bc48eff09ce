#include "server/compute_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>

namespace binpose::server {
namespace {

TEST(ComputePool, RunsAllThatWasQueuedBeforeItEnds) {
  std::atomic<int> done = 0;
  {
    ComputePool pool("tasks", 3, 100);
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(pool.submit([&] { ++done; }).ok());
  }
  EXPECT_EQ(done, 100);
}

TEST(ComputePool, RefusesWhatTheQueueCannotHoldAndSaysSo) {
  std::latch running(1);
  std::latch may_end(1);
  ComputePool pool("tasks", 1, 2);
  ASSERT_TRUE(pool.submit([&] {
                    running.count_down();
                    may_end.wait();
                  })
                  .ok());
  running.wait();
  EXPECT_TRUE(pool.submit([] {}).ok());
  EXPECT_TRUE(pool.submit([] {}).ok());
  const absl::Status refused = pool.submit([] {});
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.message(), "The server is full: 2 tasks wait already; try again later.");
  may_end.count_down();
}

TEST(ComputePool, SharesItsThreadsAmongWhatRunsAndWaits) {
  std::latch running(2);
  std::latch may_end(1);
  ComputePool pool("tasks", 4, 10);
  EXPECT_EQ(pool.fair_share(), 4);
  const auto task = [&] {
    running.count_down();
    may_end.wait();
  };
  ASSERT_TRUE(pool.submit(task).ok());
  ASSERT_TRUE(pool.submit(task).ok());
  running.wait();
  EXPECT_EQ(pool.fair_share(), 2);
  may_end.count_down();
}

}  // namespace
}  // namespace binpose::server

#include "server/compute_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <latch>
#include <stop_token>
#include <thread>

#include "server/memory_budget.h"
#include "server/refusal.h"

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

/// One that is busy and knows that a task takes about 20 ms.
class BusyPoolTest : public ::testing::Test {
 protected:
  BusyPoolTest() {
    std::latch learnt(1);
    EXPECT_TRUE(pool_.submit([] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); }).ok());
    EXPECT_TRUE(pool_.submit([&] { learnt.count_down(); }).ok());
    learnt.wait();
    std::latch running(1);
    EXPECT_TRUE(pool_
                    .submit([&] {
                      running.count_down();
                      may_end_.wait();
                    })
                    .ok());
    running.wait();
  }
  ~BusyPoolTest() override { may_end_.count_down(); }

  std::latch may_end_{1};
  ComputePool pool_{"tasks", 1, 10};
};

TEST_F(BusyPoolTest, RefusesATaskThatWouldEndAfterItsDeadlineAndSaysWhenToComeAgain) {
  EXPECT_TRUE(pool_.submit([] {}, {.deadline = Clock::now() + std::chrono::hours(1)}).ok());
  const absl::Status refused = pool_.submit([] {}, {.deadline = Clock::now() + std::chrono::milliseconds(1)});
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal_of(refused), Refusal::kDeadline);
  EXPECT_GT(retry_info_of(refused)->retry_delay().nanos(), 0);
}

TEST_F(BusyPoolTest, ACallerThatHasGoneFreesItsPlaceWhileThePoolIsBusy) {
  std::stop_source caller;
  bool ran = false;
  ASSERT_TRUE(pool_.submit([&] { ran = true; }, {.stop = caller.get_token()}).ok());
  ASSERT_TRUE(pool_.submit([] {}).ok());
  pool_.run_stopped();
  EXPECT_EQ(pool_.waiting(), 2);
  caller.request_stop();
  pool_.run_stopped();
  EXPECT_TRUE(ran);
  EXPECT_EQ(pool_.waiting(), 1);
}

TEST(MemoryBudget, HoldsWhatSharesTakeAndGetsItBack) {
  MemoryBudget budget(100, 100);
  {
    auto share = budget.take(60);
    ASSERT_TRUE(share.ok());
    const absl::Status refused = budget.take(41).status();
    EXPECT_EQ(refusal_of(refused), Refusal::kMemory);
    EXPECT_TRUE(budget.take(40).ok());
    const MemoryBudget::Share moved = *std::move(share);
    EXPECT_EQ(budget.used(), 60);
  }
  EXPECT_EQ(budget.used(), 0);
}

TEST(MemoryBudget, GivesSharesThatWereAddedBackTogether) {
  MemoryBudget budget(100, 100);
  {
    MemoryBudget::Share sum;
    sum.add(*budget.take(30));
    sum.add(*budget.take(50));
    EXPECT_EQ(budget.used(), 80);
  }
  EXPECT_EQ(budget.used(), 0);
}

TEST(MemoryBudget, AMessageThatIsTooLargeIsToldItsSizeTheLimitAndTheOptionAndNotToComeAgain) {
  constexpr std::size_t kMiB = 1 << 20;
  MemoryBudget budget(100 * kMiB, 2 * kMiB);
  EXPECT_TRUE(budget.take(2 * kMiB).ok());
  const absl::Status status = budget.take(2 * kMiB + 1).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message(),
            "The message has 2.1 MiB; the server's limit, --max-message-mib, is 2. Send less, or raise it.");
  EXPECT_FALSE(retry_info_of(status).has_value());
  EXPECT_EQ(budget.used(), 0);
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

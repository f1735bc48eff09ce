#include "server/hang_guard.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <thread>

namespace binpose::server {
namespace {

TEST(HangGuard, WaitsForSlowWorkWhileTheDirectoryAnswers) {
  HangGuard guard("models", [] { return true; });
  EXPECT_TRUE(guard
                  .run([] {
                    std::this_thread::sleep_for(kDirectoryPatience + std::chrono::seconds(1));
                    return absl::OkStatus();
                  })
                  .ok());
}

TEST(HangGuard, LeavesWorkThatHangsRefusesMoreAndEndsWithTheWork) {
  std::promise<void> is_back;
  std::atomic<int> done = 0;
  std::thread share;
  {
    HangGuard guard("models", [] { return false; });
    const absl::Status status = guard.run([&done, back = is_back.get_future().share()] {
      back.wait();
      ++done;
      return absl::OkStatus();
    });
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
    EXPECT_EQ(guard.run([&done] { return ++done, absl::OkStatus(); }).code(), absl::StatusCode::kUnavailable);
    EXPECT_EQ(done, 0);
    share = std::thread([&is_back] { is_back.set_value(); });
  }
  EXPECT_EQ(done, 1);
  share.join();
}

}  // namespace
}  // namespace binpose::server

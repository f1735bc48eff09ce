#include "server/hang_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/log_lines.h"

namespace binpose::server {
namespace {

using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr HangGuard::Times kShort = {.patience = milliseconds(100), .rest = milliseconds(0)};

void wait_for_lines(const LogLines& log, std::size_t count) {
  while (log.lines().size() < count) std::this_thread::yield();
}

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

TEST(HangGuard, LogsOnceThatTheDirectoryDoesNotAnswerAndOnceThatItDoes) {
  const LogLines log;
  std::promise<void> is_back;
  HangGuard guard(
      "models", [back = is_back.get_future().share()] { return back.wait(), true; }, kShort);
  wait_for_lines(log, 1);
  std::this_thread::sleep_for(4 * kShort.patience);
  EXPECT_THAT(log.lines(),
              ElementsAre(AllOf(HasSubstr("warning"), HasSubstr("The model directory models is away since 2"),
                                HasSubstr("it does not answer"), HasSubstr("/proc/mounts"))));
  is_back.set_value();
  wait_for_lines(log, 2);
  EXPECT_THAT(log.lines().back(), AllOf(HasSubstr("info"), HasSubstr("the model directory models answers again")));
}

TEST(HangGuard, LogsWhyADirectoryIsNoneAndThatItIsOneAgainOnlyWhenThatWasSeen) {
  const LogLines log;
  HangGuard guard("models", [] { return true; }, {.patience = std::chrono::seconds(2), .rest = milliseconds(0)});
  guard.note_fault(absl::UnavailableError("It lacks its sign."));
  wait_for_lines(log, 1);
  EXPECT_THAT(log.lines(), ElementsAre(HasSubstr("It lacks its sign.")));
  std::this_thread::sleep_for(milliseconds(500));
  EXPECT_EQ(log.lines().size(), 1);
  guard.note_answer();
  wait_for_lines(log, 2);
}

TEST(HangGuard, TellsADirectoryThatComesAndGoesOnlyOnceInAWhile) {
  const LogLines log;
  HangGuard guard("models", [] { return true; }, {.patience = milliseconds(100), .rest = std::chrono::minutes(1)});
  for (int i = 0; i < 5; ++i) {
    guard.note_fault(absl::UnavailableError("It lacks its sign."));
    std::this_thread::sleep_for(milliseconds(50));
    guard.note_answer();
    std::this_thread::sleep_for(milliseconds(50));
  }
  EXPECT_LE(log.lines().size(), 2);
}

TEST(HangGuard, SaysNothingOfADirectoryThatAnswers) {
  const LogLines log;
  {
    HangGuard guard("models", [] { return true; }, {.patience = std::chrono::seconds(3)});
    std::this_thread::sleep_for(std::chrono::seconds(4));
  }
  EXPECT_THAT(log.lines(), IsEmpty());
}

}  // namespace
}  // namespace binpose::server

#include "client/cli/load.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/client/fake_server.h"

namespace binpose::client::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

/// Four scans in a second, so that even a busy machine sends the last in time.
LoadPlan small_plan() {
  LoadPlan plan;
  for (const char* id : {"a", "b"}) {
    v1::DetectRequest request;
    request.set_request_id(id);
    plan.requests.push_back(std::make_shared<const v1::DetectRequest>(std::move(request)));
  }
  plan.rate = 4;
  plan.duration = 1;
  return plan;
}

TEST(Load, SendsAsManyScansAsBecomeDueInTurn) {
  FakeServer server;
  Client client(server.address());
  const LoadReport report = run_load(small_plan(), client);
  EXPECT_EQ(report.due, 4U);
  EXPECT_EQ(report.answered, 4U);
  EXPECT_EQ(report.latency.count(), 4U);
  EXPECT_TRUE(report.errors.empty());
  std::vector<std::string> ids;
  for (const v1::DetectRequest& request : server.detect_requests()) ids.push_back(request.request_id());
  EXPECT_THAT(ids, ElementsAre("a", "b", "a", "b"));
}

TEST(Load, SpreadsTheScansOverTheStreams) {
  FakeServer server;
  Client client(server.address());
  LoadPlan plan = small_plan();
  plan.streams = 3;
  EXPECT_EQ(run_load(plan, client).answered, 4U);
  EXPECT_EQ(server.stream_count(), 3);
}

TEST(Load, CountsTheWaitOfScansThatTheServerIsLateFor) {
  FakeServer server;
  server.answer = [](const v1::DetectRequest&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return v1::DetectResponse();
  };
  Client client(server.address());
  LoadPlan plan = small_plan();
  plan.rate = 1000;  // the n-th answer cannot come before n * 100 ms
  plan.duration = 0.004;
  const LoadReport report = run_load(plan, client);
  ASSERT_EQ(report.answered + report.unsent, 4U);
  EXPECT_GE(report.latency.max(), 0.1 * static_cast<double>(report.answered) - 0.01);
}

TEST(Load, CountsRefusedScansByTheirReason) {
  FakeServer server;
  server.answer = [](const v1::DetectRequest& request) {
    v1::DetectResponse response;
    if (request.request_id() == "a") return response;
    response.mutable_error()->set_code(8);
    response.mutable_error()->set_message("The server is full.");
    return response;
  };
  Client client(server.address());
  const LoadReport report = run_load(small_plan(), client);
  EXPECT_EQ(report.answered, 2U);
  EXPECT_THAT(report.errors, ElementsAre(Pair("The server is full.", 2U)));
}

TEST(Load, AStreamThatBreaksIsAnErrorAndNoHang) {
  FakeServer server;
  server.answers_before_end = 1;
  Client client(server.address());
  const LoadReport report = run_load(small_plan(), client);
  EXPECT_EQ(report.answered, 1U);
  EXPECT_EQ(report.errors.size(), 1U);
}

}  // namespace
}  // namespace binpose::client::cli

#include "client/detect_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "tests/client/fake_server.h"

namespace binpose::client {
namespace {

using ::testing::HasSubstr;

constexpr int kFrameCount = 50;

v1::DetectRequest frame(int number, std::size_t bytes = 0) {
  v1::DetectRequest request;
  request.set_request_id(std::to_string(number));
  request.mutable_cloud()->set_pcd(std::string(bytes, 'x'));
  return request;
}

TEST(DetectStream, FiftyFramesWrittenBeforeAnyAnswerIsReadDoNotHang) {
  FakeServer server;
  // Answers too large for the buffers on the way: a client that did not take them would stop the server.
  server.answer = [](const v1::DetectRequest&) {
    v1::DetectResponse response;
    response.add_warnings(std::string(1 << 20, 'w'));
    return response;
  };
  Client client(server.address());
  const std::unique_ptr<DetectStream> stream = client.open_detect_stream();
  for (int i = 0; i < kFrameCount; ++i) ASSERT_TRUE(stream->write(frame(i, 1 << 20)).ok());
  stream->done_writing();
  for (int i = 0; i < kFrameCount; ++i) {
    const std::optional<v1::DetectResponse> answer = stream->read();
    ASSERT_TRUE(answer.has_value());
    EXPECT_EQ(answer->request_id(), std::to_string(i));
  }
  EXPECT_FALSE(stream->read().has_value());
  EXPECT_TRUE(stream->finish().ok());
}

TEST(DetectStream, TakesAnswersLargerThanGrpcsDefaultLimit) {
  FakeServer server;
  server.answer = [](const v1::DetectRequest&) {
    v1::DetectResponse response;
    response.add_warnings(std::string(8 << 20, 'w'));
    return response;
  };
  EXPECT_TRUE(Client(server.address()).detect(frame(0, 8 << 20)).ok());
}

TEST(DetectStream, GivesTheAnswersThatCameBeforeItBroke) {
  FakeServer server;
  server.answers_before_end = 1;
  Client client(server.address());
  const std::unique_ptr<DetectStream> stream = client.open_detect_stream();
  EXPECT_TRUE(stream->write(frame(0)).ok());
  EXPECT_TRUE(stream->read().has_value());
  EXPECT_FALSE(stream->read().has_value());
  const absl::Status end = stream->finish();
  EXPECT_EQ(end.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(end.message()), HasSubstr("had enough"));
}

TEST(DetectStream, WritingToABrokenStreamSaysWhyItBroke) {
  FakeServer server;
  server.answers_before_end = 0;
  Client client(server.address());
  const std::unique_ptr<DetectStream> stream = client.open_detect_stream();
  absl::Status status;
  for (int i = 0; i < 1000 && status.ok(); ++i) status = stream->write(frame(i));
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("had enough"));
}

/// Writes and reads frames in turn over one stream; the numbers of those answered, and how the stream ended.
std::pair<std::vector<std::string>, absl::Status> exchange(Client& client, int count) {
  const std::unique_ptr<DetectStream> stream = client.open_detect_stream();
  std::thread writer([&] {
    for (int i = 0; i < count && stream->write(frame(i, 1 << 18)).ok(); ++i) {
    }
    stream->done_writing();
  });
  std::vector<std::string> answered;
  while (const auto answer = stream->read()) answered.push_back(answer->request_id());
  writer.join();
  return {answered, stream->finish()};
}

std::vector<std::string> numbers(int count) {
  std::vector<std::string> all;
  for (int i = 0; i < count; ++i) all.push_back(std::to_string(i));
  return all;
}

TEST(DetectStream, AStreamThatItsServerEndsToBeReplacedIsOpenedAgainAndEveryFrameIsAnsweredOnce) {
  FakeServer server;
  server.answers_before_end = 3;
  server.break_status = {grpc::StatusCode::UNAVAILABLE, "The server is about to end."};
  Client client(server.address());
  const auto [answered, end] = exchange(client, 20);
  EXPECT_EQ(answered, numbers(20));
  EXPECT_TRUE(end.ok()) << end;
  EXPECT_GE(server.stream_count(), 7);
}

TEST(DetectStream, WhatABalancerMakesOfALostServerIsALossAndWhatTheServerSaysIsNot) {
  using grpc::StatusCode;
  EXPECT_TRUE(is_lost({StatusCode::INTERNAL, "Received RST_STREAM with error code 2"}));
  EXPECT_TRUE(is_lost({StatusCode::UNKNOWN, "No status received"}));
  EXPECT_TRUE(is_lost({StatusCode::UNKNOWN, "Stream removed"}));
  EXPECT_FALSE(is_lost({StatusCode::RESOURCE_EXHAUSTED, "Received RST_STREAM with error code 11"}));
  EXPECT_FALSE(is_lost({StatusCode::INTERNAL, "The server failed."}));
  EXPECT_FALSE(is_lost(grpc::Status::OK));
}

TEST(DetectStream, AFrameThatBreaksEveryStreamIsGivenUpAfterTheAttempts) {
  FakeServer server;
  server.answers_before_end = 0;
  server.break_status = {grpc::StatusCode::UNAVAILABLE, "The server is about to end."};
  Client client(server.address(), {}, {.attempts = 3, .first_pause = std::chrono::milliseconds(1)});
  EXPECT_EQ(exchange(client, 1).second.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(server.stream_count(), 4);
}

TEST(DetectStream, WithoutRetriesTheCallerIsToldAtOnce) {
  FakeServer server;
  server.answers_before_end = 1;
  server.break_status = {grpc::StatusCode::UNAVAILABLE, "The server is about to end."};
  Client client(server.address(), {}, {.attempts = 0});
  const auto [answered, end] = exchange(client, 5);
  EXPECT_EQ(answered, numbers(1));
  EXPECT_EQ(end.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(server.stream_count(), 1);
}

TEST(DetectStream, GoesOnToTheNextServerWhereOneIsGone) {
  FakeServer breaking;
  breaking.answers_before_end = 2;
  breaking.break_status = {grpc::StatusCode::UNAVAILABLE, "The server is about to end."};
  FakeServer good;
  Client client("127.0.0.1:1," + breaking.address() + "," + good.address());
  const auto [answered, end] = exchange(client, 10);
  EXPECT_EQ(answered, numbers(10));
  EXPECT_TRUE(end.ok()) << end;
  EXPECT_EQ(breaking.stream_count(), 1);
  EXPECT_EQ(good.stream_count(), 1);
}

TEST(DetectStream, AttemptsAreNotMadeBeyondTheTimeoutForAnAnswer) {
  Client client("127.0.0.1:1", {.answer = std::chrono::milliseconds(100)}, {.attempts = 1'000'000});
  EXPECT_EQ(exchange(client, 1).second.code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(DetectStream, TellsABalancerTheModelOfItsFirstFrame) {
  FakeServer server;
  Client client(server.address());
  v1::DetectRequest request;
  for (const char* id : {"gear", "", "two\nlines"}) {
    request.clear_model_ids();
    request.add_model_ids(id);
    EXPECT_TRUE(client.detect(request).ok());
  }
  EXPECT_EQ(server.routing_keys(), std::vector<std::string>({"gear", "", ""}));
}

/// A server that gets no further than its first frame until the test lets it.
class StuckServer : public ::testing::Test {
 protected:
  StuckServer() {
    server_.answer = [gate = gate_.get_future().share()](const v1::DetectRequest&) {
      gate.wait();
      return v1::DetectResponse();
    };
  }
  ~StuckServer() override { gate_.set_value(); }

  std::promise<void> gate_;
  FakeServer server_;
};

TEST_F(StuckServer, AnAnswerThatDoesNotComeEndsTheStreamAfterTheTimeout) {
  Client client(server_.address(), {.answer = std::chrono::milliseconds(50)});
  const std::unique_ptr<DetectStream> stream = client.open_detect_stream();
  ASSERT_TRUE(stream->write(frame(0)).ok());
  EXPECT_FALSE(stream->read().has_value());
  EXPECT_EQ(stream->finish().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST_F(StuckServer, CancelFreesAReaderInAnotherThread) {
  Client client(server_.address());
  const std::unique_ptr<DetectStream> stream = client.open_detect_stream();
  ASSERT_TRUE(stream->write(frame(0)).ok());
  std::future<bool> has_answer = std::async(std::launch::async, [&] { return stream->read().has_value(); });
  stream->cancel();
  EXPECT_FALSE(has_answer.get());
  EXPECT_EQ(stream->finish().code(), absl::StatusCode::kCancelled);
}

TEST_F(StuckServer, AStreamThatIsDroppedDoesNotWaitForItsAnswers) {
  Client client(server_.address());
  ASSERT_TRUE(client.open_detect_stream()->write(frame(0)).ok());
}

}  // namespace
}  // namespace binpose::client

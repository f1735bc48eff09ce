#include "client/detect_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

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
  EXPECT_FALSE(stream->read().has_value());
  const absl::Status status = stream->write(frame(0));
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("had enough"));
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

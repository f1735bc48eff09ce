#include "server/detect_stream.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "binpose/v1/detection_service.grpc.pb.h"
#include "server/frame_bytes.h"
#include "server/status.h"

namespace binpose::server {
namespace {

/// Serves Detect with frames answered by a function of the test.
class StreamServer final : public v1::DetectionService::WithRawCallbackMethod_Detect<v1::DetectionService::Service>,
                           private FrameHandler {
 public:
  using Answer = std::function<void(const std::string& request_id, const RunControl& control)>;

  StreamServer(int threads, std::size_t queue, Answer answer)
      : answer_(std::move(answer)), pool_("detections", threads, queue) {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
    channel_ = grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials());
    stub_ = v1::DetectionService::NewStub(channel_);
  }
  ~StreamServer() override { server_->Shutdown(std::chrono::system_clock::now()); }

  v1::DetectionService::Stub& stub() { return *stub_; }
  Drain& drain() { return drain_; }
  ComputePool& pool() { return pool_; }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Detect(grpc::CallbackServerContext* context) override {
    return new DetectStream({*this, pool_, memory_, drain_, writes_, streams_}, *context, std::nullopt, "");
  }

 private:
  grpc::ByteBuffer answer(grpc::ByteBuffer& frame, Clock::time_point /*arrival*/, const RunControl& control) override {
    v1::DetectResponse response;
    response.set_request_id(request_id_of(frame));
    answer_(response.request_id(), control);
    return encode(response);
  }
  grpc::ByteBuffer refuse(grpc::ByteBuffer& frame, const absl::Status& reason) override {
    v1::DetectResponse response;
    response.set_request_id(request_id_of(frame));
    *response.mutable_error() = to_error(reason);
    return encode(response);
  }

  void note_cancel(CancelPlace /*place*/, double /*seconds*/) override {}

  Answer answer_;
  MemoryBudget memory_{std::size_t{1} << 30, std::size_t{1} << 20};
  Drain drain_;
  WriteWatch writes_{std::chrono::milliseconds(500)};
  prometheus::Gauge streams_;
  ComputePool pool_;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::DetectionService::Stub> stub_;
};

v1::DetectRequest request(const std::string& id) {
  v1::DetectRequest request;
  request.set_request_id(id);
  return request;
}

/// A number that threads wait for.
class Counter {
 public:
  void add(int change) {
    const std::lock_guard lock(mutex_);
    value_ += change;
    most_ = std::max(most_, value_);
    changed_.notify_all();
  }
  bool wait_for(int value, std::chrono::milliseconds timeout = std::chrono::seconds(60)) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, timeout, [&] { return value_ >= value; });
  }
  int most() {
    const std::lock_guard lock(mutex_);
    return most_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int value_ = 0;
  int most_ = 0;
};

TEST(DetectStream, AnswersInOrderWhenALaterFrameIsReadyFirst) {
  Counter second_done;
  StreamServer server(2, 10, [&](const std::string& id, const RunControl&) {
    if (id == "second") second_done.add(1);
    EXPECT_TRUE(second_done.wait_for(1));
  });
  grpc::ClientContext context;
  const auto stream = server.stub().Detect(&context);
  ASSERT_TRUE(stream->Write(request("first")));
  ASSERT_TRUE(stream->Write(request("second")));
  stream->WritesDone();
  v1::DetectResponse answer;
  ASSERT_TRUE(stream->Read(&answer));
  EXPECT_EQ(answer.request_id(), "first");
  ASSERT_TRUE(stream->Read(&answer));
  EXPECT_EQ(answer.request_id(), "second");
  EXPECT_FALSE(stream->Read(&answer));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST(DetectStream, HoldsTwoUnansweredFramesAndNeverAThird) {
  constexpr int kFrames = 20;
  Counter held;
  StreamServer server(4, 10, [&](const std::string&, const RunControl&) {
    held.add(1);
    held.wait_for(3, std::chrono::milliseconds(20));  // gives a third the chance to come
    held.add(-1);
  });
  grpc::ClientContext context;
  const auto stream = server.stub().Detect(&context);
  std::thread writer([&] {
    for (int i = 0; i < kFrames; ++i) stream->Write(request(std::to_string(i)));
    stream->WritesDone();
  });
  v1::DetectResponse answer;
  int answers = 0;
  while (stream->Read(&answer)) EXPECT_EQ(answer.request_id(), std::to_string(answers++));
  writer.join();
  EXPECT_EQ(answers, kFrames);
  EXPECT_EQ(held.most(), 2);
}

TEST(DetectStream, CancellingStopsTheComputation) {
  Counter started;
  Counter stopped;
  StreamServer server(1, 10, [&](const std::string&, const RunControl& control) {
    started.add(1);
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any wake;
    wake.wait(lock, control.stop, [] { return false; });
    stopped.add(1);
  });
  grpc::ClientContext context;
  const auto stream = server.stub().Detect(&context);
  ASSERT_TRUE(stream->Write(request("endless")));
  ASSERT_TRUE(started.wait_for(1));
  context.TryCancel();
  EXPECT_TRUE(stopped.wait_for(1));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(server.drain().wait_for_calls(std::chrono::seconds(60)));  // the stream is gone
}

TEST(DetectStream, ACallerThatTakesNoAnswersIsCutOff) {
  StreamServer server(1, 10, [](const std::string&, const RunControl&) {});
  grpc::ClientContext context;
  const auto stream = server.stub().Detect(&context);
  const std::string long_id(256, 'x');  // the answers fill what the connection takes on its own
  while (stream->Write(request(long_id))) {
  }
  v1::DetectResponse answer;
  while (stream->Read(&answer)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(server.drain().wait_for_calls(std::chrono::seconds(60)));
}

TEST(DetectStream, AFrameThatFindsTheServerFullIsToldSoWithItsId) {
  Counter started;
  Counter may_end;
  StreamServer server(1, 1, [](const std::string&, const RunControl&) {});
  ASSERT_TRUE(server.pool()
                  .submit([&] {
                    started.add(1);
                    EXPECT_TRUE(may_end.wait_for(1));
                  })
                  .ok());
  ASSERT_TRUE(started.wait_for(1));
  ASSERT_TRUE(server.pool().submit([] {}).ok());  // takes the one place in the queue
  grpc::ClientContext context;
  const auto stream = server.stub().Detect(&context);
  v1::DetectResponse answer;
  ASSERT_TRUE(stream->Write(request("one too many")));
  ASSERT_TRUE(stream->Read(&answer));
  EXPECT_EQ(answer.request_id(), "one too many");
  EXPECT_EQ(answer.error().code(), static_cast<int>(absl::StatusCode::kResourceExhausted));
  EXPECT_NE(answer.error().message().find("1 detections wait"), std::string::npos) << answer.error().message();
  may_end.add(1);
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&answer));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST(DetectStream, DrainingAnswersWhatWasReadAndEndsIdleStreams) {
  Counter started;
  Counter may_end;
  StreamServer server(1, 10, [&](const std::string&, const RunControl&) {
    started.add(1);
    EXPECT_TRUE(may_end.wait_for(1));
  });
  grpc::ClientContext busy_context;
  const auto busy = server.stub().Detect(&busy_context);
  ASSERT_TRUE(busy->Write(request("read")));
  ASSERT_TRUE(started.wait_for(1));
  grpc::ClientContext idle_context;
  const auto idle = server.stub().Detect(&idle_context);
  server.drain().start();
  v1::DetectResponse answer;
  EXPECT_FALSE(idle->Read(&answer));
  EXPECT_EQ(idle->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  may_end.add(1);
  ASSERT_TRUE(busy->Read(&answer));
  EXPECT_EQ(answer.request_id(), "read");
  EXPECT_FALSE(busy->Read(&answer));
  EXPECT_EQ(busy->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(server.drain().wait_for_calls(std::chrono::seconds(60)));
}

}  // namespace
}  // namespace binpose::server

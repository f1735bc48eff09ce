#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <future>
#include <map>
#include <optional>
#include <thread>

#include "grpc/health/v1/health.grpc.pb.h"
#include "tests/server/http_get.h"
#include "tests/server/running_server.h"
#include "tests/server/test_part.h"

namespace binpose::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace health = ::grpc::health::v1;

TEST(Health, ServesTheServerAndBothServicesAndKnowsNoOther) {
  RunningServer server;
  const auto stub = health::Health::NewStub(server.channel());
  for (const char* service : {"", "binpose.v1.ModelService", "binpose.v1.DetectionService"}) {
    grpc::ClientContext context;
    health::HealthCheckRequest request;
    request.set_service(service);
    health::HealthCheckResponse response;
    ASSERT_TRUE(stub->Check(&context, request, &response).ok()) << service;
    EXPECT_EQ(response.status(), health::HealthCheckResponse::SERVING) << service;
  }
  grpc::ClientContext context;
  health::HealthCheckRequest request;
  request.set_service("binpose.v1.Nothing");
  health::HealthCheckResponse response;
  EXPECT_EQ(stub->Check(&context, request, &response).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST(Health, TurnsToNotServingWhenTheServerStopsWhichAWatcherDoesNotHoldUp) {
  RunningServer server;
  const auto stub = health::Health::NewStub(server.channel());
  grpc::ClientContext context;
  const auto watch = stub->Watch(&context, {});
  health::HealthCheckResponse response;
  ASSERT_TRUE(watch->Read(&response));
  EXPECT_EQ(response.status(), health::HealthCheckResponse::SERVING);
  // Reads while the server stops: a client drops what it has not read when the call is cancelled.
  auto next = std::async(std::launch::async, [&] { return watch->Read(&response); });
  server.server().stop();
  ASSERT_TRUE(next.get());
  EXPECT_EQ(response.status(), health::HealthCheckResponse::NOT_SERVING);
}

/// Asks gRPC's reflection service, whose messages the server's library brings but no header declares.
/// @param request  JSON. @return the answer as JSON.
std::string reflect(RunningServer& server, const std::string& request) {
  const auto* pool = google::protobuf::DescriptorPool::generated_pool();
  auto* factory = google::protobuf::MessageFactory::generated_factory();
  const auto make = [&](const char* type) {
    return std::unique_ptr<google::protobuf::Message>(factory->GetPrototype(pool->FindMessageTypeByName(type))->New());
  };
  const auto question = make("grpc.reflection.v1alpha.ServerReflectionRequest");
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(request, question.get()).ok());
  const grpc::Slice slice(question->SerializeAsString());

  grpc::GenericStub stub(server.channel());
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok) && ok);
  };
  const auto stream =
      stub.PrepareCall(&context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  stream->StartCall(nullptr);
  wait();
  stream->Write(grpc::ByteBuffer(&slice, 1), nullptr);
  wait();
  grpc::ByteBuffer bytes;
  stream->Read(&bytes, nullptr);
  wait();
  context.TryCancel();
  grpc::Status status;
  stream->Finish(&status, nullptr);
  wait();
  grpc::Slice whole;
  EXPECT_TRUE(bytes.DumpToSingleSlice(&whole).ok());
  const auto answer = make("grpc.reflection.v1alpha.ServerReflectionResponse");
  EXPECT_TRUE(answer->ParseFromArray(whole.begin(), static_cast<int>(whole.size())));
  return answer->DebugString();
}

TEST(Reflection, ListsTheServices) {
  RunningServer server;
  const std::string answer = reflect(server, R"({"listServices": "*"})");
  for (const char* service : {"binpose.v1.ModelService", "binpose.v1.DetectionService", "grpc.health.v1.Health"}) {
    EXPECT_THAT(answer, HasSubstr(service));
  }
}

TEST(Reflection, DescribesTheServicesAndHealth) {
  RunningServer server;
  const std::map<std::string, std::string> files = {
      {"binpose.v1.DetectionService", "binpose/v1/detection_service.proto"},
      {"binpose.v1.ModelService", "binpose/v1/model_service.proto"},
      {"grpc.health.v1.Health", "grpc/health/v1/health.proto"}};
  for (const auto& [service, file] : files) {
    const std::string answer = reflect(server, R"({"fileContainingSymbol": ")" + service + R"("})");
    EXPECT_THAT(answer, HasSubstr(file));
    EXPECT_THAT(answer, Not(HasSubstr("error_response")));
  }
}

/// A server that serves metrics too.
class MetricsTest : public ::testing::Test {
 protected:
  RunningServer& start() {
    Config config = test_config(directory_.path());
    config.metrics = "127.0.0.1:0";
    return start(config);
  }
  RunningServer& start(const Config& config) { return server_.emplace(config); }
  const std::filesystem::path& model_dir() const { return directory_.path(); }
  const std::string& address() { return server_->server().metrics_address(); }

  void expect_lines(std::initializer_list<const char*> lines) {
    const std::string answer = http_get(address(), "/metrics");
    for (const char* line : lines) EXPECT_NE(answer.find(line), std::string::npos) << line;
  }

 private:
  TemporaryDirectory directory_;
  std::optional<RunningServer> server_;
};

TEST_F(MetricsTest, SayThatTheServerIsNotReadyWhileItDrainsAndStillTakesCalls) {
  Config config = test_config(model_dir());
  config.metrics = "127.0.0.1:0";
  config.drain_delay_seconds = 2;
  RunningServer& server = start(config);
  ASSERT_TRUE(server.train(train_request("block")).ok());
  std::jthread stopping([&] { server.server().stop(); });
  std::string ready;
  for (int i = 0; i < 100 && ready.find("503") == std::string::npos; ++i) ready = http_get(address(), "/readyz");
  EXPECT_THAT(ready, HasSubstr("503"));
  EXPECT_FALSE(server.detect({detect_request("1", "block")}).front().has_error());
  EXPECT_THAT(http_get(address(), "/healthz"), HasSubstr("200 OK"));
}

TEST_F(MetricsTest, CountRequestsByMethodAndCodeAndTimeTheStages) {
  RunningServer& server = start();
  ASSERT_TRUE(server.train(train_request("block")).ok());
  server.detect({detect_request("1", "block"), detect_request("2", "block"), detect_request("3", "gear")});
  expect_lines({"HTTP/1.1 200 OK", "binpose_requests_total{code=\"OK\",method=\"Train\"} 1\n",
                "binpose_requests_total{code=\"OK\",method=\"Detect\"} 2\n",
                "binpose_requests_total{code=\"NOT_FOUND\",method=\"Detect\"} 1\n",
                "binpose_request_duration_seconds_count{method=\"Detect\"} 3\n",
                "binpose_request_duration_seconds_bucket{method=\"Detect\",le=\"+Inf\"} 3\n",
                "binpose_detect_stage_duration_seconds_count{stage=\"refine\"} 2\n",
                "binpose_detect_queue_duration_seconds_count 2\n", "binpose_models_loaded 1\n",
                "binpose_model_files_skipped_total 0\n", "binpose_train_duration_seconds_count 1\n",
                "binpose_model_searches_total{model=\"block\"} 2\n"});
}

TEST_F(MetricsTest, DropTheSeriesOfAModelWithTheModel) {
  RunningServer& server = start();
  ASSERT_TRUE(server.train(train_request("block")).ok());
  server.detect({detect_request("1", "block")});
  expect_lines(
      {"binpose_model_searches_total{model=\"block\"} 1\n", "binpose_model_hypotheses_total{model=\"block\"} "});
  grpc::ClientContext context;
  v1::DeleteModelRequest request;
  request.set_id("block");
  v1::DeleteModelResponse response;
  ASSERT_TRUE(server.models().DeleteModel(&context, request, &response).ok());
  EXPECT_THAT(http_get(address(), "/metrics"), Not(HasSubstr("block")));
}

TEST_F(MetricsTest, CountTheModelFilesThatWereSkipped) {
  std::ofstream(model_dir() / "torn.model") << "torn";
  start();
  expect_lines({"binpose_model_files_skipped_total 1\n"});
}

TEST_F(MetricsTest, SayThatTheModelDirectoryIsAwayWhileTheServerStaysReady) {
  RunningServer& server = start();
  ASSERT_TRUE(server.train(train_request("block")).ok());
  EXPECT_THAT(http_get(address(), "/readyz"), ::testing::EndsWith("\r\n\r\nready\n"));
  std::filesystem::rename(model_dir(), model_dir().string() + ".away");
  std::string answer;
  for (int i = 0; i < 600 && answer.find("has not been read") == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    answer = http_get(address(), "/readyz");
  }
  EXPECT_THAT(answer, ::testing::AllOf(HasSubstr("200 OK"), HasSubstr("The model directory has not been read for")));
  EXPECT_EQ(server.train(train_request("block")).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_FALSE(server.detect({detect_request("1", "block")}).front().has_error());
  std::filesystem::rename(model_dir().string() + ".away", model_dir());
}

TEST_F(MetricsTest, AreServedWhileOtherSocketsStaySilent) {
  start();
  const std::array<int, 3> sockets = {connect_to(address()), connect_to(address()), connect_to(address())};
  expect_lines({"200 OK"});
  for (const int socket : sockets) ::close(socket);
}

TEST_F(MetricsTest, AnAddressThatIsTakenIsAnErrorThatNamesIt) {
  start();
  const TemporaryDirectory directory;
  Config config = test_config(directory.path());
  config.metrics = address();
  const auto second = Server::start(config);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(config.metrics));
}

TEST(Server, APortThatIsTakenIsAnErrorThatNamesIt) {
  RunningServer server;
  const TemporaryDirectory directory;
  Config config = test_config(directory.path());
  config.listen = server.server().address();
  const auto second = Server::start(config);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(config.listen));
}

}  // namespace
}  // namespace binpose::server

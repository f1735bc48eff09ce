#include <fcntl.h>
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <regex>
#include <string>

#include "binpose/v1/detection_service.grpc.pb.h"
#include "binpose/v1/model_service.grpc.pb.h"
#include "tests/server/temporary_directory.h"
#include "tests/server/test_part.h"

namespace binpose::server {
namespace {

/// The program binpose-server as a child process with free ports.
class ServerProcess {
 public:
  explicit ServerProcess(const std::filesystem::path& model_dir) {
    std::array<int, 2> pipe{};
    EXPECT_EQ(::pipe2(pipe.data(), O_CLOEXEC), 0);
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(pipe[1], STDOUT_FILENO);
      ::execl(BINPOSE_SERVER, BINPOSE_SERVER, "--listen", "127.0.0.1:0", "--metrics", "127.0.0.1:0", "--model-dir",
              model_dir.c_str(), "--drain-timeout", "300", nullptr);  // trainings are slow where others are busy
      ::_exit(127);
    }
    ::close(pipe[1]);
    output_ = ::fdopen(pipe[0], "r");
    std::array<char, 256> line{};
    if (std::fgets(line.data(), line.size(), output_) != nullptr) first_line_ = line.data();
    std::smatch match;
    if (std::regex_match(first_line_, match, std::regex("listening on (\\S+), metrics on (\\S+)\n"))) {
      channel_ = grpc::CreateChannel(match[1], grpc::InsecureChannelCredentials());
    }
  }
  ~ServerProcess() {
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      wait();
    }
    std::fclose(output_);
  }
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  const std::string& first_line() const { return first_line_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  void signal(int number) const { ::kill(child_, number); }
  /// How the process ended, as waitpid() tells.
  int wait() {
    int status = -1;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return status;
  }

 private:
  pid_t child_ = -1;
  std::FILE* output_ = nullptr;
  std::string first_line_;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST(ServerProcess, TellsItsAddressesOnTheFirstLineAndEndsWellOnEitherSignal) {
  for (const int number : {SIGTERM, SIGINT}) {
    const TemporaryDirectory directory;
    ServerProcess process(directory.path());
    EXPECT_THAT(process.first_line(),
                ::testing::MatchesRegex("listening on 127.0.0.1:[0-9]+, metrics on 127.0.0.1:[0-9]+\n"));
    process.signal(number);
    const int status = process.wait();
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
}

TEST(ServerProcess, FinishesOnSigtermWhatRunsAndEndsIdleStreams) {
  const TemporaryDirectory directory;
  ServerProcess process(directory.path());
  const auto models = v1::ModelService::NewStub(process.channel());
  const auto detections = v1::DetectionService::NewStub(process.channel());
  grpc::ClientContext stream_context;
  const auto stream = detections->Detect(&stream_context);
  v1::DetectResponse answer;
  ASSERT_TRUE(stream->Write(detect_request("1", "none")));
  ASSERT_TRUE(stream->Read(&answer));

  grpc::ClientContext context;
  const auto reader = models->Train(&context, train_request("block"));
  v1::TrainResponse message;
  ASSERT_TRUE(reader->Read(&message));
  process.signal(SIGTERM);
  while (reader->Read(&message)) {
  }
  const grpc::Status trained = reader->Finish();
  EXPECT_TRUE(trained.ok()) << trained.error_message();
  EXPECT_EQ(message.stage(), v1::TRAIN_STAGE_DONE);
  EXPECT_FALSE(stream->Read(&answer));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  const int status = process.wait();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(ServerProcess, KeepsAnAcknowledgedModelWhenItIsKilled) {
  const TemporaryDirectory directory;
  {
    ServerProcess process(directory.path());
    const auto models = v1::ModelService::NewStub(process.channel());
    grpc::ClientContext context;
    const auto reader = models->Train(&context, train_request("block"));
    v1::TrainResponse message;
    while (reader->Read(&message) && !message.has_model()) {
    }
    ASSERT_TRUE(message.has_model());
    process.signal(SIGKILL);
    process.wait();
  }
  ServerProcess process(directory.path());
  const auto models = v1::ModelService::NewStub(process.channel());
  grpc::ClientContext context;
  v1::GetModelRequest request;
  request.set_id("block");
  v1::Model model;
  EXPECT_TRUE(models->GetModel(&context, request, &model).ok());
}

}  // namespace
}  // namespace binpose::server

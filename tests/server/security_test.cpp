#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>
#include <tuple>

#include "tests/server/running_server.h"
#include "tests/server/test_part.h"

namespace binpose::server {
namespace {

std::string read_pem(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class SecurityTest : public ::testing::Test {
 protected:
  /// Makes `name`.pem and `name`.key, self-signed for localhost.
  void make_certificate(const std::string& name) const {
    const std::string base = path() / name;
    const std::string command =
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 "
        "-subj /CN=localhost -addext subjectAltName=DNS:localhost,IP:127.0.0.1 -keyout " +
        base + ".key -out " + base + ".pem 2>/dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0);  // NOLINT: the test's own words
  }

  Config tls_config() const {
    Config config = test_config(path() / "models");
    config.tls_cert = path() / "server.pem";
    config.tls_key = path() / "server.key";
    return config;
  }

  /// How a new connection's first call ends.
  grpc::Status list(const std::string& address, const grpc::SslCredentialsOptions& options) const {
    // A pool of its own, so that no session of an earlier connection is taken up.
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto stub = v1::ModelService::NewStub(grpc::CreateCustomChannel(
        "localhost" + address.substr(address.rfind(':')), grpc::SslCredentials(options), arguments));
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
    v1::ListModelsResponse response;
    return stub->ListModels(&context, {}, &response);
  }

  const std::filesystem::path& path() const { return directory_.path(); }

 private:
  TemporaryDirectory directory_;
};

TEST_F(SecurityTest, ANewCertificateIsTakenUpWhileStreamsOfTheOldOneGoOn) {
  make_certificate("server");
  auto server = Server::start(tls_config());
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string old_ca = read_pem(path() / "server.pem");
  const grpc::Status status = list((*server)->address(), {old_ca, "", ""});
  EXPECT_TRUE(status.ok()) << status.error_message();

  // A stream that was opened with the old certificate ...
  const auto stub = v1::DetectionService::NewStub(
      grpc::CreateChannel("localhost" + (*server)->address().substr((*server)->address().rfind(':')),
                          grpc::SslCredentials({old_ca, "", ""})));
  grpc::ClientContext context;
  const auto stream = stub->Detect(&context);
  const auto is_answered = [&stream](const std::string& id) {
    v1::DetectRequest request;
    request.set_request_id(id);
    v1::DetectResponse answer;
    return stream->Write(request) && stream->Read(&answer) && answer.request_id() == id;
  };
  EXPECT_TRUE(is_answered("before"));

  make_certificate("next");
  std::filesystem::rename(path() / "next.key", path() / "server.key");
  std::filesystem::rename(path() / "next.pem", path() / "server.pem");
  bool taken_up = false;
  for (int i = 0; i < 50 && !taken_up; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    taken_up = list((*server)->address(), {read_pem(path() / "server.pem"), "", ""}).ok();
  }
  EXPECT_TRUE(taken_up);
  EXPECT_TRUE(is_answered("after"));  // ... lives on
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(SecurityTest, MutualTlsLetsInOnlyWhoShowsACertificate) {
  make_certificate("server");
  make_certificate("robot");
  make_certificate("stranger");
  Config config = tls_config();
  config.tls_client_ca = path() / "robot.pem";
  auto server = Server::start(config);
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string ca = read_pem(path() / "server.pem");
  const auto as = [&](const std::string& name) {
    return list((*server)->address(), {ca, read_pem(path() / (name + ".key")), read_pem(path() / (name + ".pem"))});
  };
  EXPECT_TRUE(as("robot").ok()) << as("robot").error_message();
  EXPECT_FALSE(as("stranger").ok());
  EXPECT_FALSE(list((*server)->address(), {ca, "", ""}).ok());
}

TEST_F(SecurityTest, EveryCallNeedsATokenOfItsRole) {
  std::ofstream(path() / "tokens") << "detect aaaaaaaaaaaaaaaa\ntrain bbbbbbbbbbbbbbbb\n";
  Config config = test_config(path() / "models");
  config.token_file = path() / "tokens";
  RunningServer server(config);
  const auto with = [](grpc::ClientContext& context, const std::string& token) -> grpc::ClientContext* {
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
    return &context;
  };
  const auto train = [&](const std::string& token) {
    grpc::ClientContext context;
    const auto reader = server.models().Train(with(context, token), train_request("block"));
    v1::TrainResponse message;
    while (reader->Read(&message)) {
    }
    return reader->Finish().error_code();
  };
  const auto detect = [&](const std::string& token) {
    grpc::ClientContext context;
    const auto stream = server.detections().Detect(with(context, token));
    stream->WritesDone();
    return stream->Finish().error_code();
  };
  EXPECT_EQ(train(""), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(train("aaaaaaaaaaaaaaaa"), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(train("bbbbbbbbbbbbbbbb"), grpc::StatusCode::OK);
  EXPECT_EQ(detect(""), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(detect("aaaaaaaaaaaaaaaa"), grpc::StatusCode::OK);
  EXPECT_EQ(detect("bbbbbbbbbbbbbbbb"), grpc::StatusCode::OK);

  v1::Model model;
  v1::ListModelsResponse list;
  v1::DeleteModelResponse deleted;
  v1::GetModelRequest get_request;
  get_request.set_id("block");
  v1::GetModelShapeRequest shape_request;
  shape_request.set_id("block");
  v1::GetModelShapeResponse shape;
  v1::DeleteModelRequest delete_request;
  delete_request.set_id("block");
  for (const auto& [token, reading, changing] :
       {std::tuple("", grpc::StatusCode::UNAUTHENTICATED, grpc::StatusCode::UNAUTHENTICATED),
        std::tuple("aaaaaaaaaaaaaaaa", grpc::StatusCode::OK, grpc::StatusCode::PERMISSION_DENIED),
        std::tuple("bbbbbbbbbbbbbbbb", grpc::StatusCode::OK, grpc::StatusCode::OK)}) {
    std::array<grpc::ClientContext, 4> contexts;
    EXPECT_EQ(server.models().GetModel(with(contexts[0], token), get_request, &model).error_code(), reading);
    EXPECT_EQ(server.models().ListModels(with(contexts[1], token), {}, &list).error_code(), reading);
    EXPECT_EQ(server.models().GetModelShape(with(contexts[3], token), shape_request, &shape).error_code(), reading);
    EXPECT_EQ(server.models().DeleteModel(with(contexts[2], token), delete_request, &deleted).error_code(), changing);
  }
}

}  // namespace
}  // namespace binpose::server

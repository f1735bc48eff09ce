#include "client/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/scene.h"
#include "tests/client/fake_server.h"

namespace binpose::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string sentence(const absl::Status& status) { return std::string(status.message()); }

TEST(Client, TrainReportsProgressAndReturnsTheModel) {
  FakeServer server;
  Client client(server.address());
  v1::TrainRequest request;
  request.set_id("gear");
  std::vector<double> progress;
  const absl::StatusOr<v1::Model> model =
      client.train(request, [&](const v1::TrainResponse& response) { progress.push_back(response.progress()); });
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(model->id(), "gear");
  EXPECT_THAT(progress, ElementsAre(0.25, 1));
}

TEST(Client, ATrainingThatEndsWithoutAModelIsAnError) {
  FakeServer server;
  server.sends_model = false;
  v1::TrainRequest request;
  request.set_id("gear");
  EXPECT_THAT(sentence(Client(server.address()).train(request).status()),
              AllOf(HasSubstr("gear"), HasSubstr("no model")));
}

TEST(Client, ListsGetsAndDeletesModels) {
  FakeServer server;
  Client client(server.address());
  const absl::StatusOr<v1::ListModelsResponse> models = client.list_models();
  ASSERT_TRUE(models.ok()) << models.status();
  EXPECT_EQ(models->models_size(), 2);
  const absl::StatusOr<v1::Model> model = client.get_model("gear");
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(model->id(), "gear");
  const absl::StatusOr<v1::GetModelShapeResponse> shape = client.get_model_shape("gear");
  ASSERT_TRUE(shape.ok()) << shape.status();
  EXPECT_EQ(shape->surface(), "twelve bytes");
  EXPECT_TRUE(client.delete_model("gear").ok());
}

TEST(Client, AnErrorSaysWhatFailedAndGivesTheServersReason) {
  FakeServer server;
  server.call_status = {grpc::StatusCode::NOT_FOUND, "There is no model \"gear\"."};
  const absl::Status status = Client(server.address()).delete_model("gear");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(sentence(status), AllOf(HasSubstr("Deleting model \"gear\" failed"), HasSubstr("There is no model")));
}

TEST(Client, NoServerIsAnErrorThatNamesTheAddress) {
  std::string address;
  { address = FakeServer().address(); }
  const absl::Status status = Client(address).list_models().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(sentence(status), AllOf(HasSubstr(address), HasSubstr("Is binpose-server running there")));
}

TEST(Client, GoesOnToTheNextServerWhereOneCannotBeReached) {
  FakeServer server;
  Client client("127.0.0.1:1, " + server.address());
  EXPECT_TRUE(client.list_models().ok());
  EXPECT_TRUE(client.check_health().ok());
  EXPECT_EQ(Client("127.0.0.1:1," + server.address(), {}, {.attempts = 0}).list_models().status().code(),
            absl::StatusCode::kUnavailable);
}

TEST(Client, AnotherServiceIsToldFromOurs) {
  FakeServer server;
  server.call_status = {grpc::StatusCode::UNIMPLEMENTED, ""};
  EXPECT_THAT(sentence(Client(server.address()).list_models().status()), HasSubstr("another service"));
}

TEST(Client, DetectSearchesOneScan) {
  FakeServer server;
  server.answer = [](const v1::DetectRequest& request) {
    v1::DetectResponse response;
    response.add_hypotheses()->set_model_id(request.model_ids(0));
    return response;
  };
  v1::DetectRequest request;
  request.add_model_ids("gear");
  *request.mutable_cloud() = cloud_from_points(std::vector<float>{1, 2, 3}, v1::LENGTH_UNIT_METRE);
  const absl::StatusOr<v1::DetectResponse> answer = Client(server.address()).detect(request);
  ASSERT_TRUE(answer.ok()) << answer.status();
  ASSERT_EQ(answer->hypotheses_size(), 1);
  EXPECT_EQ(answer->hypotheses(0).model_id(), "gear");
}

TEST(Client, DetectTurnsTheErrorOfAnAnswerIntoAStatus) {
  FakeServer server;
  server.answer = [](const v1::DetectRequest&) {
    v1::DetectResponse response;
    response.mutable_error()->set_code(5);
    response.mutable_error()->set_message("There is no model \"gear\".");
    return response;
  };
  const absl::Status status = Client(server.address()).detect(v1::DetectRequest()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(sentence(status), "There is no model \"gear\".");
}

}  // namespace
}  // namespace binpose::client

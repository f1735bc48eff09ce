#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "tests/server/running_server.h"
#include "tests/server/test_part.h"

namespace binpose::server {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::Ge;
using ::testing::Gt;
using ::testing::HasSubstr;
using ::testing::Lt;
using ::testing::Test;

/// Multiplies the coordinates of a binary STL.
void scale(v1::TrainRequest& request, float factor) {
  std::string& stl = *request.mutable_mesh()->mutable_data();
  for (std::size_t triangle = 84; triangle < stl.size(); triangle += 50) {
    for (std::size_t at = triangle + 12; at < triangle + 48; at += sizeof(float)) {
      float coordinate = 0;
      std::memcpy(&coordinate, &stl[at], sizeof(coordinate));
      coordinate *= factor;
      std::memcpy(&stl[at], &coordinate, sizeof(coordinate));
    }
  }
}

class ModelServiceTest : public Test {
 protected:
  grpc::Status get(const std::string& id, v1::Model* model) {
    grpc::ClientContext context;
    v1::GetModelRequest request;
    request.set_id(id);
    return server_.models().GetModel(&context, request, model);
  }

  grpc::Status get_shape(const std::string& id, v1::GetModelShapeResponse* shape) {
    grpc::ClientContext context;
    v1::GetModelShapeRequest request;
    request.set_id(id);
    return server_.models().GetModelShape(&context, request, shape);
  }

  grpc::Status remove(const std::string& id) {
    grpc::ClientContext context;
    v1::DeleteModelRequest request;
    request.set_id(id);
    v1::DeleteModelResponse response;
    return server_.models().DeleteModel(&context, request, &response);
  }

  std::vector<std::string> list() {
    grpc::ClientContext context;
    v1::ListModelsResponse response;
    EXPECT_TRUE(server_.models().ListModels(&context, {}, &response).ok());
    std::vector<std::string> ids;
    for (const v1::Model& model : response.models()) ids.push_back(model.id());
    return ids;
  }

  RunningServer server_;
};

/// Packed numbers, as they came over the wire.
template <typename Number>
std::vector<Number> unpack(const std::string& bytes) {
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return numbers;
}

TEST_F(ModelServiceTest, AShapeHoldsThePointsAndPairsOfTheModelInMetres) {
  ASSERT_TRUE(server_.train(train_request("block")).ok());
  v1::Model model;
  ASSERT_TRUE(get("block", &model).ok());
  v1::GetModelShapeResponse shape;
  ASSERT_TRUE(get_shape("block", &shape).ok());
  const std::vector<float> surface = unpack<float>(shape.surface());
  const std::vector<float> observability = unpack<float>(shape.observability());
  ASSERT_GT(surface.size(), 300U);
  EXPECT_EQ(shape.normals().size(), shape.surface().size());
  EXPECT_EQ(observability.size(), surface.size() / 3);
  for (std::size_t i = 0; i < surface.size(); i += 3) {
    EXPECT_LE(surface[i], model.bounding_box_max().x() + 1e-6);
    EXPECT_GE(surface[i], model.bounding_box_min().x() - 1e-6);
  }
  // No point of a closed surface is seen from much more than half of all viewpoints.
  EXPECT_THAT(observability, Each(AllOf(Ge(0.0F), Lt(0.6F))));
  EXPECT_THAT(observability, Contains(Gt(0.2F)));
  const std::size_t point_count = unpack<float>(shape.pair_points()).size() / 3;
  EXPECT_EQ(point_count, model.point_count());
  EXPECT_EQ(unpack<std::uint32_t>(shape.pairs()).size(), 3 * model.pair_count());
  EXPECT_THAT(unpack<std::uint32_t>(shape.pairs()), Each(Lt(point_count)));
}

TEST_F(ModelServiceTest, TheShapeOfAnUnknownModelIsNotFound) {
  v1::GetModelShapeResponse shape;
  EXPECT_EQ(get_shape("ghost", &shape).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(get_shape("../ghost", &shape).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(ModelServiceTest, TrainingReportsProgressThatNeverFallsAndEndsWithTheModel) {
  std::vector<v1::TrainResponse> messages;
  ASSERT_TRUE(server_.train(train_request("block"), &messages).ok());
  double progress = 0;
  for (const v1::TrainResponse& message : messages) {
    EXPECT_GE(message.progress(), progress);
    EXPECT_EQ(message.has_model(), message.stage() == v1::TRAIN_STAGE_DONE);
    progress = message.progress();
  }
  EXPECT_EQ(messages.front().stage(), v1::TRAIN_STAGE_QUEUED);
  ASSERT_EQ(messages.back().stage(), v1::TRAIN_STAGE_DONE);
  EXPECT_EQ(progress, 1);
  const v1::Model& model = messages.back().model();
  EXPECT_EQ(model.id(), "block");
  EXPECT_NEAR(model.diameter(), 0.0748, 0.0002);  // from (60, 0, 20) to (0, 40, 0)
  EXPECT_NEAR(model.bounding_box_max().x(), 0.06, 1e-6);
  EXPECT_EQ(model.generation(), 1);
  EXPECT_EQ(model.content_hash().size(), 64);
  EXPECT_GT(model.point_count(), 0);
  EXPECT_GT(model.pair_count(), 0);
  EXPECT_GT(model.file_bytes(), 0);
  EXPECT_GT(model.create_time().seconds(), 1'600'000'000);
  ASSERT_GE(model.symmetry().discrete_size(), 1);
  EXPECT_EQ(model.symmetry().discrete(0).orientation().w(), 1);
}

TEST_F(ModelServiceTest, ATrainedModelIsServedUntilItIsDeleted) {
  ASSERT_TRUE(server_.train(train_request("b")).ok());
  ASSERT_TRUE(server_.train(train_request("a")).ok());
  v1::Model model;
  EXPECT_TRUE(get("b", &model).ok());
  EXPECT_EQ(model.id(), "b");
  EXPECT_EQ(list(), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(remove("b").ok());
  EXPECT_EQ(list(), std::vector<std::string>{"a"});
  const grpc::Status status = get("b", &model);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(), HasSubstr("'b'"));
  EXPECT_EQ(remove("b").error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(ModelServiceTest, EqualTrainingsGiveEqualHashesAndCountUp) {
  std::vector<v1::TrainResponse> messages;
  ASSERT_TRUE(server_.train(train_request("block"), &messages).ok());
  const v1::Model first = messages.back().model();
  ASSERT_TRUE(server_.train(train_request("block"), &messages).ok());
  const v1::Model second = messages.back().model();
  EXPECT_EQ(second.generation(), 2);
  EXPECT_EQ(second.content_hash(), first.content_hash());
}

TEST_F(ModelServiceTest, AFailedTrainingLeavesTheModelAsItWas) {
  ASSERT_TRUE(server_.train(train_request("block")).ok());
  v1::TrainRequest request = train_request("block");
  request.mutable_mesh()->mutable_data()->resize(200);
  EXPECT_EQ(server_.train(request).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::Model model;
  ASSERT_TRUE(get("block", &model).ok());
  EXPECT_EQ(model.generation(), 1);
}

TEST_F(ModelServiceTest, ACancelledTrainingLeavesTheModelAsItWas) {
  ASSERT_TRUE(server_.train(train_request("block")).ok());
  grpc::ClientContext context;
  v1::TrainRequest request = train_request("block");
  request.mutable_params()->set_relative_sampling(0.02);  // takes long enough to be cancelled
  request.mutable_params()->set_viewpoint_count(4096);
  const auto reader = server_.models().Train(&context, request);
  v1::TrainResponse message;
  while (reader->Read(&message) && message.stage() != v1::TRAIN_STAGE_SAMPLING) {
  }
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  // Trainings run one after the other, so that the cancelled one has ended when the next has.
  std::vector<v1::TrainResponse> messages;
  ASSERT_TRUE(server_.train(train_request("block"), &messages).ok());
  EXPECT_EQ(messages.back().model().generation(), 2);
}

TEST_F(ModelServiceTest, ATrainingPastItsDeadlineEndsWithDeadlineExceeded) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(1));
  const auto reader = server_.models().Train(&context, train_request("block"));
  v1::TrainResponse message;
  while (reader->Read(&message)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(list().empty());
}

TEST_F(ModelServiceTest, ModelsAreThereAgainAfterARestart) {
  const TemporaryDirectory directory;
  std::string hash;
  {
    RunningServer first(directory.path());
    std::vector<v1::TrainResponse> messages;
    ASSERT_TRUE(first.train(train_request("block")).ok());
    ASSERT_TRUE(first.train(train_request("block"), &messages).ok());
    hash = messages.back().model().content_hash();
  }
  RunningServer second(directory.path());
  grpc::ClientContext context;
  v1::ListModelsResponse response;
  ASSERT_TRUE(second.models().ListModels(&context, {}, &response).ok());
  ASSERT_EQ(response.models_size(), 1);
  EXPECT_EQ(response.models(0).id(), "block");
  EXPECT_EQ(response.models(0).generation(), 2);
  EXPECT_EQ(response.models(0).content_hash(), hash);
  std::vector<v1::TrainResponse> messages;
  ASSERT_TRUE(second.train(train_request("block"), &messages).ok());
  EXPECT_EQ(messages.back().model().generation(), 3);
}

TEST_F(ModelServiceTest, AMeshAThousandTimesTooBigOrSmallForItsUnitIsTrainedWithAWarning) {
  for (const float factor : {1000.F, 0.001F}) {
    v1::TrainRequest request = train_request("block");
    scale(request, factor);
    std::vector<v1::TrainResponse> messages;
    const grpc::Status status = server_.train(request, &messages);
    ASSERT_TRUE(status.ok()) << status.error_message();
    ASSERT_EQ(messages.back().model().warnings_size(), 1);
    EXPECT_THAT(messages.back().model().warnings(0), HasSubstr("mesh.unit = LENGTH_UNIT_MILLIMETRE"));
  }
  std::vector<v1::TrainResponse> messages;
  ASSERT_TRUE(server_.train(train_request("block"), &messages).ok());
  EXPECT_EQ(messages.back().model().warnings_size(), 0);
}

TEST_F(ModelServiceTest, ATrainingOverTheLimitIsToldSizeLimitAndOption) {
  v1::TrainRequest request = train_request("large");
  request.mutable_mesh()->mutable_data()->resize(std::size_t{70} << 20);
  const grpc::Status status = server_.train(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("70.1 MiB; the server's limit, --max-message-mib, is 64"));
}

/// A training request that is refused, and what the message must say.
struct BadTraining {
  const char* name;
  void (*spoil)(v1::TrainRequest&);
  std::vector<const char*> says;
};

std::ostream& operator<<(std::ostream& out, const BadTraining& bad) { return out << bad.name; }

class RefusesTrainingTest : public ModelServiceTest, public ::testing::WithParamInterface<BadTraining> {};

TEST_P(RefusesTrainingTest, WithAMessageThatNamesFieldValueAndLimit) {
  v1::TrainRequest request = train_request("block");
  GetParam().spoil(request);
  const grpc::Status status = server_.train(request);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
  for (const char* text : GetParam().says) EXPECT_THAT(status.error_message(), HasSubstr(text));
  EXPECT_TRUE(list().empty());
}

INSTANTIATE_TEST_SUITE_P(
    Of, RefusesTrainingTest,
    ::testing::Values(
        BadTraining{"NoId", [](v1::TrainRequest& r) { r.clear_id(); }, {"id is ''", "1 to 64"}},
        BadTraining{"IdWithASlash", [](v1::TrainRequest& r) { r.set_id("../x"); }, {"id is '../x'", "1 to 64"}},
        BadTraining{"IdOfTwoDots", [](v1::TrainRequest& r) { r.set_id(".."); }, {"id is '..'"}},
        BadTraining{"LongId", [](v1::TrainRequest& r) { r.set_id(std::string(65, 'a')); }, {"id has 65", "1 to 64"}},
        BadTraining{"NoUnit", [](v1::TrainRequest& r) { r.mutable_mesh()->clear_unit(); }, {"mesh.unit is not set"}},
        BadTraining{"UnknownUnit",
                    [](v1::TrainRequest& r) { r.mutable_mesh()->set_unit(static_cast<v1::LengthUnit>(9)); },
                    {"mesh.unit is 9"}},
        BadTraining{"NoMesh", [](v1::TrainRequest& r) { r.mutable_mesh()->clear_data(); }, {"mesh.data"}},
        BadTraining{"TruncatedMesh",
                    [](v1::TrainRequest& r) { r.mutable_mesh()->mutable_data()->resize(999); },
                    {"mesh.data", "999", "1284"}},
        BadTraining{"MeshThatIsNotFinite",
                    [](v1::TrainRequest& r) { scale(r, std::numeric_limits<float>::quiet_NaN()); },
                    {"finite"}},
        BadTraining{"MeshWithoutArea",
                    [](v1::TrainRequest& r) {
                      r.mutable_mesh()->set_data(
                          "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 1\n"
                          "vertex 2 2 2\nendloop\nendfacet\nendsolid s\n");
                    },
                    {"area"}},
        BadTraining{"MeshAsLargeAsATown", [](v1::TrainRequest& r) { scale(r, 1e6F); }, {"diameter", "unit"}},
        BadTraining{"UnknownFormat",
                    [](v1::TrainRequest& r) { r.mutable_mesh()->set_format(static_cast<v1::MeshFormat>(9)); },
                    {"mesh.format is 9"}},
        BadTraining{"Parameter",
                    [](v1::TrainRequest& r) { r.mutable_params()->set_relative_sampling(0.5); },
                    {"relative_sampling", "0.5", "0.1"}},
        BadTraining{"HugeCount",
                    [](v1::TrainRequest& r) { r.mutable_params()->set_viewpoint_count(4'000'000'000); },
                    {"viewpoint_count", "4096"}},
        BadTraining{"NanParameter",
                    [](v1::TrainRequest& r) {
                      r.mutable_params()->set_bin_width_degrees(std::numeric_limits<double>::quiet_NaN());
                    },
                    {"bin_width_degrees", "45"}},
        BadTraining{"UnknownPreset",
                    [](v1::TrainRequest& r) { r.mutable_params()->set_preset(static_cast<v1::TrainPreset>(9)); },
                    {"params.preset is 9"}}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace binpose::server

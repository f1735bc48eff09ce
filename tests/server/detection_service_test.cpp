#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "tests/server/running_server.h"
#include "tests/server/test_part.h"

namespace binpose::server {
namespace {

using ::testing::HasSubstr;

constexpr int kInvalid = static_cast<int>(absl::StatusCode::kInvalidArgument);
constexpr int kNotFound = static_cast<int>(absl::StatusCode::kNotFound);
constexpr int kExhausted = static_cast<int>(absl::StatusCode::kResourceExhausted);

/// One server that knows the model "block", for all tests.
class DetectionServiceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    server_ = new RunningServer();
    ASSERT_TRUE(server_->train(train_request("block")).ok());
  }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }

  static RunningServer& server() { return *server_; }

 private:
  static inline RunningServer* server_ = nullptr;
};

TEST_F(DetectionServiceTest, FindsThePartAndAnswersInTheUnitOfTheCloud) {
  v1::DetectRequest in_millimetres = detect_request("mm", "block");
  v1::DetectRequest in_metres = in_millimetres;
  in_metres.mutable_cloud()->set_unit(v1::LENGTH_UNIT_METRE);
  in_metres.mutable_cloud()->mutable_depth()->set_depth_scale(0.001);
  const auto answers = server().detect({in_millimetres, in_metres});
  ASSERT_EQ(answers.size(), 2);
  for (const v1::DetectResponse& answer : answers) ASSERT_GE(answer.hypotheses_size(), 1) << answer.DebugString();
  const v1::PoseHypothesis& best = answers[0].hypotheses(0);
  EXPECT_EQ(best.model_id(), "block");
  // All but certain of the surface, though from here the block could lie the other way round.
  EXPECT_GT(best.score(), 0.5 * best.confidence());
  EXPECT_GT(best.score(), 0.4);
  EXPECT_GT(best.variants_size(), 0);
  EXPECT_NEAR(best.pose().position().x(), -20, 2);
  EXPECT_NEAR(best.pose().position().y(), -15, 2);
  EXPECT_NEAR(best.pose().position().z(), 400, 2);
  const v1::Quaternion& q = best.pose().orientation();
  EXPECT_GE(q.w(), 0);
  EXPECT_NEAR(std::hypot(std::hypot(q.x(), q.y()), std::hypot(q.z(), q.w())), 1, 1e-9);
  const v1::PoseHypothesis& metric = answers[1].hypotheses(0);
  EXPECT_NEAR(metric.pose().position().z(), best.pose().position().z() / 1000, 1e-6);
  EXPECT_NEAR(metric.residual(), best.residual() / 1000, 1e-6);
  EXPECT_GT(answers[0].stats().total_seconds(), 0);
  EXPECT_GT(answers[0].stats().point_count(), 1000);
  EXPECT_NE(answers[0].stats().stop_reason(), v1::STOP_REASON_UNSPECIFIED);
}

TEST_F(DetectionServiceTest, AnswersWhatScoredTooLittleOnlyWhenAskedAndApart) {
  v1::DetectRequest request = detect_request("strict", "block");
  request.mutable_params()->set_min_score(1);
  v1::DetectRequest curious = request;
  curious.mutable_params()->set_max_rejected(3);
  const auto answers = server().detect({request, curious});
  ASSERT_EQ(answers.size(), 2);
  EXPECT_EQ(answers[0].rejected_size(), 0);
  EXPECT_EQ(answers[1].hypotheses_size(), 0);
  ASSERT_GE(answers[1].rejected_size(), 1);
  EXPECT_LE(answers[1].rejected_size(), 3);
  EXPECT_NEAR(answers[1].rejected(0).pose().position().z(), 400, 2);
}

TEST_F(DetectionServiceTest, SearchesForSeveralModelsInOneRequest) {
  ASSERT_TRUE(server().train(train_request("twin")).ok());
  v1::DetectRequest request = detect_request("both", "block");
  request.add_model_ids("twin");
  const auto answers = server().detect({request});
  ASSERT_EQ(answers.size(), 1);
  EXPECT_FALSE(answers[0].has_error()) << answers[0].error().message();
  EXPECT_GE(answers[0].hypotheses_size(), 1);
}

TEST_F(DetectionServiceTest, ATimeBudgetThatIsOverEndsTheSearchAndTheAnswerSaysSo) {
  v1::DetectRequest hasty = detect_request("hasty", "block"), patient = detect_request("patient", "block");
  hasty.set_time_budget_seconds(0.001);  // the scan alone takes longer to read
  patient.set_time_budget_seconds(3600);
  const auto answers = server().detect({hasty, patient});
  ASSERT_EQ(answers.size(), 2);
  EXPECT_FALSE(answers[0].has_error()) << answers[0].error().message();
  EXPECT_EQ(answers[0].stats().stop_reason(), v1::STOP_REASON_DEADLINE);
  EXPECT_EQ(answers[1].stats().stop_reason(), v1::STOP_REASON_COMPLETE);
  EXPECT_GE(answers[1].hypotheses_size(), 1);
}

TEST_F(DetectionServiceTest, AnswersManyFramesInOrderWithTheirIds) {
  std::vector<v1::DetectRequest> requests(12, detect_request("", "block"));
  for (std::size_t i = 0; i < requests.size(); ++i) requests[i].set_request_id(absl::StrCat("frame ", i));
  const auto answers = server().detect(requests);
  ASSERT_EQ(answers.size(), requests.size());
  for (std::size_t i = 0; i < answers.size(); ++i) EXPECT_EQ(answers[i].request_id(), requests[i].request_id());
}

TEST_F(DetectionServiceTest, ACancelledStreamLeavesTheServerWell) {
  {
    grpc::ClientContext context;
    const auto stream = server().detections().Detect(&context);
    ASSERT_TRUE(stream->Write(detect_request("lost", "block")));
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_EQ(server().detect({detect_request("next", "block")}).size(), 1);
}

TEST_F(DetectionServiceTest, AFrameOverTheLimitIsToldSizeLimitAndOptionAndTheStreamLivesOn) {
  v1::DetectRequest large = detect_request("large", "block");
  large.mutable_cloud()->set_pcd(std::string(std::size_t{70} << 20, ' '));
  const auto answers = server().detect({large, detect_request("next", "block")});
  ASSERT_EQ(answers.size(), 2);
  EXPECT_EQ(answers[0].request_id(), "large");
  EXPECT_EQ(answers[0].error().code(), kExhausted);
  EXPECT_THAT(answers[0].error().message(), HasSubstr("70.1 MiB; the server's limit, --max-message-mib, is 64"));
  EXPECT_FALSE(answers[0].error().has_retry_delay());
  EXPECT_GE(answers[1].hypotheses_size(), 1);
}

TEST(DetectionServiceLimits, AFrameOfMoreThanTwiceTheLimitEndsTheCall) {
  const TemporaryDirectory directory;
  Config config = test_config(directory.path());
  config.max_message_mib = 1;
  config.request_memory_mib = 2;
  RunningServer server(config);
  grpc::ClientContext context;
  const auto stream = server.detections().Detect(&context);
  v1::DetectRequest request;
  request.mutable_cloud()->set_pcd(std::string(std::size_t{3} << 20, ' '));
  stream->Write(request);
  stream->WritesDone();
  v1::DetectResponse answer;
  EXPECT_FALSE(stream->Read(&answer));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(DetectionServiceTest, AFrameThatIsNoRequestIsAnsweredAndTheStreamLivesOn) {
  // A client that sends bytes, where the typed one could not send these.
  grpc::GenericStub stub(server().channel());
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto exchange = [&](grpc::GenericClientAsyncReaderWriter& stream, const std::string& bytes) {
    const grpc::Slice slice(bytes);
    stream.Write(grpc::ByteBuffer(&slice, 1), nullptr);
    EXPECT_TRUE(wait());
    grpc::ByteBuffer answer;
    stream.Read(&answer, nullptr);
    EXPECT_TRUE(wait());
    grpc::Slice whole;
    EXPECT_TRUE(answer.DumpToSingleSlice(&whole).ok());
    v1::DetectResponse response;
    EXPECT_TRUE(response.ParseFromArray(whole.begin(), static_cast<int>(whole.size())));
    return response;
  };
  const auto stream = stub.PrepareCall(&context, "/binpose.v1.DetectionService/Detect", &queue);
  stream->StartCall(nullptr);
  ASSERT_TRUE(wait());
  const v1::DetectResponse bad = exchange(*stream, "\x0a\x02id\xff\xff\xff");
  EXPECT_EQ(bad.error().code(), kInvalid);
  EXPECT_EQ(bad.request_id(), "id");
  EXPECT_THAT(bad.error().message(), HasSubstr("7 bytes"));
  const v1::DetectResponse no_text = exchange(*stream, "\x0a\x01\xff");
  EXPECT_EQ(no_text.error().code(), kInvalid);
  EXPECT_EQ(no_text.request_id(), "");
  const v1::DetectResponse good = exchange(*stream, detect_request("good", "block").SerializeAsString());
  EXPECT_FALSE(good.has_error());
  EXPECT_EQ(good.request_id(), "good");
  stream->WritesDone(nullptr);
  ASSERT_TRUE(wait());
  grpc::Status status;
  stream->Finish(&status, nullptr);
  ASSERT_TRUE(wait());
  EXPECT_TRUE(status.ok());
}

/// A frame that is refused, and what the answer must say.
struct BadFrame {
  const char* name;
  void (*spoil)(v1::DetectRequest&);
  int code;
  std::vector<const char*> says;
};

std::ostream& operator<<(std::ostream& out, const BadFrame& bad) { return out << bad.name; }

class RefusesFrameTest : public DetectionServiceTest, public ::testing::WithParamInterface<BadFrame> {};

TEST_P(RefusesFrameTest, NamingFieldValueAndLimitAndAnswersTheNext) {
  v1::DetectRequest bad = detect_request("bad", "block");
  GetParam().spoil(bad);
  const auto answers = server().detect({bad, detect_request("good", "block")});
  ASSERT_EQ(answers.size(), 2);
  EXPECT_EQ(answers[0].request_id(), bad.request_id());
  EXPECT_EQ(answers[0].error().code(), GetParam().code) << answers[0].DebugString();
  for (const char* text : GetParam().says) EXPECT_THAT(answers[0].error().message(), HasSubstr(text));
  EXPECT_FALSE(answers[0].has_stats());
  EXPECT_EQ(answers[1].request_id(), "good");
  EXPECT_FALSE(answers[1].has_error()) << answers[1].error().message();
}

v1::PackedPoints& packed(v1::DetectRequest& request, std::uint32_t width, std::uint32_t height, float value) {
  v1::PackedPoints& points = *request.mutable_cloud()->mutable_points();
  points.set_width(width);
  points.set_height(height);
  std::string& bytes = *points.mutable_xyz();
  for (std::uint32_t i = 0; i < 3 * width * height; ++i) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  return points;
}

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    Of, RefusesFrameTest,
    ::testing::Values(
        BadFrame{"LongRequestId",
                 [](v1::DetectRequest& r) { r.set_request_id(std::string(257, 'x')); },
                 kInvalid,
                 {"request_id has 257", "256"}},
        BadFrame{"NoModel", [](v1::DetectRequest& r) { r.clear_model_ids(); }, kInvalid, {"model_ids has 0", "16"}},
        BadFrame{"TooManyModels",
                 [](v1::DetectRequest& r) {
                   for (int i = 0; i < 16; ++i) r.add_model_ids(absl::StrCat("m", i));
                 },
                 kInvalid,
                 {"model_ids has 17", "16"}},
        BadFrame{
            "ModelNamedTwice", [](v1::DetectRequest& r) { r.add_model_ids("block"); }, kInvalid, {"'block' twice"}},
        BadFrame{"UnknownModel", [](v1::DetectRequest& r) { r.set_model_ids(0, "gear"); }, kNotFound, {"'gear'"}},
        BadFrame{"ImpossibleModelId", [](v1::DetectRequest& r) { r.set_model_ids(0, "a/b"); }, kInvalid, {"'a/b'"}},
        BadFrame{"NoCloud", [](v1::DetectRequest& r) { r.clear_cloud(); }, kInvalid, {"cloud.unit is not set"}},
        BadFrame{"NoUnit",
                 [](v1::DetectRequest& r) { r.mutable_cloud()->clear_unit(); },
                 kInvalid,
                 {"cloud.unit is not set", "LENGTH_UNIT_METRE"}},
        BadFrame{
            "NoData", [](v1::DetectRequest& r) { r.mutable_cloud()->clear_data(); }, kInvalid, {"cloud has no data"}},
        BadFrame{"ZeroPoints", [](v1::DetectRequest& r) { packed(r, 0, 1, 0); }, kInvalid, {"width 0", "at least 1"}},
        BadFrame{"OnlyNan", [](v1::DetectRequest& r) { packed(r, 4, 2, kNoNumber); }, kInvalid, {"cloud"}},
        BadFrame{"TooFewBytes",
                 [](v1::DetectRequest& r) { packed(r, 4, 2, 1).set_width(5); },
                 kInvalid,
                 {"cloud.points.xyz has 96 bytes", "120"}},
        BadFrame{"NormalsThatDoNotFit",
                 [](v1::DetectRequest& r) { packed(r, 4, 2, 1).set_normals("x"); },
                 kInvalid,
                 {"cloud.points.normals has 1 bytes", "96"}},
        BadFrame{"NormalsWithoutLength",
                 [](v1::DetectRequest& r) { packed(r, 4, 2, 1).set_normals(std::string(96, '\0')); },
                 kInvalid,
                 {"normal of point 0", "length 0"}},
        BadFrame{"TooManyPoints",
                 [](v1::DetectRequest& r) { packed(r, 1, 1, 1).set_width(4'000'001); },
                 kExhausted,
                 {"4000001 points", "4000000"}},
        BadFrame{"PointCountThatOverflows",
                 [](v1::DetectRequest& r) {
                   packed(r, 1, 1, 1).set_width(1U << 31);
                   r.mutable_cloud()->mutable_points()->set_height(1U << 31);
                 },
                 kExhausted,
                 {"4611686018427387904 points"}},
        BadFrame{"PointOnTheMoon",
                 [](v1::DetectRequest& r) { packed(r, 4, 2, 4e11F); },
                 kInvalid,
                 {"point 0", "4e+08 m", "1000 m"}},
        BadFrame{"NoPixels",
                 [](v1::DetectRequest& r) { r.mutable_cloud()->mutable_depth()->clear_pixels(); },
                 kInvalid,
                 {"no pixels"}},
        BadFrame{"PixelsThatDoNotFit",
                 [](v1::DetectRequest& r) { r.mutable_cloud()->mutable_depth()->set_uint16("abc"); },
                 kInvalid,
                 {"cloud.depth.uint16 has 3 bytes", "153600"}},
        BadFrame{"NoIntrinsics",
                 [](v1::DetectRequest& r) { r.mutable_cloud()->mutable_depth()->clear_intrinsics(); },
                 kInvalid,
                 {"intrinsics.fx is 0"}},
        BadFrame{"NegativeDepthScale",
                 [](v1::DetectRequest& r) { r.mutable_cloud()->mutable_depth()->set_depth_scale(-1); },
                 kInvalid,
                 {"depth_scale is -1"}},
        BadFrame{
            "TornPcd", [](v1::DetectRequest& r) { r.mutable_cloud()->set_pcd("# .PCD v0.7\nVERSION"); }, kInvalid, {}},
        BadFrame{"SensorNowhere",
                 [](v1::DetectRequest& r) { r.mutable_cloud()->mutable_sensor_position()->set_x(kNoNumber); },
                 kInvalid,
                 {"cloud.sensor_position", "1000 m"}},
        BadFrame{"NoTime",
                 [](v1::DetectRequest& r) { r.set_time_budget_seconds(0); },
                 kInvalid,
                 {"time_budget_seconds is 0", "3600]"}},
        BadFrame{"EndlessTime",
                 [](v1::DetectRequest& r) { r.set_time_budget_seconds(HUGE_VAL); },
                 kInvalid,
                 {"time_budget_seconds is inf"}},
        BadFrame{"MinScore",
                 [](v1::DetectRequest& r) { r.mutable_params()->set_min_score(2); },
                 kInvalid,
                 {"min_score is 2", "1]"}},
        BadFrame{"MaxResults",
                 [](v1::DetectRequest& r) { r.mutable_params()->set_max_results(0); },
                 kInvalid,
                 {"max_results is 0", "1000]"}},
        BadFrame{"MaxRejected",
                 [](v1::DetectRequest& r) { r.mutable_params()->set_max_rejected(1001); },
                 kInvalid,
                 {"max_rejected is 1001", "1000]"}},
        BadFrame{"StartPointShare",
                 [](v1::DetectRequest& r) { r.mutable_params()->set_start_point_share(kNoNumber); },
                 kInvalid,
                 {"start_point_share"}}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace binpose::server

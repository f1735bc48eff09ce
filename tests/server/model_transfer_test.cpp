#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/running_server.h"
#include "tests/server/test_part.h"

namespace binpose::server {
namespace {

using ::testing::HasSubstr;

grpc::Status export_model(RunningServer& server, const std::string& id, std::string& bytes) {
  grpc::ClientContext context;
  v1::ExportModelRequest request;
  request.set_id(id);
  const auto stream = server.models().ExportModel(&context, request);
  v1::ExportModelResponse part;
  while (stream->Read(&part)) bytes += part.data();
  return stream->Finish();
}

grpc::Status import_model(RunningServer& server, const std::string& id, const std::string& bytes, v1::Model& model) {
  grpc::ClientContext context;
  v1::ImportModelResponse response;
  const auto stream = server.models().ImportModel(&context, &response);
  constexpr std::size_t kPiece = 100'000;
  v1::ImportModelRequest part;
  part.set_id(id);
  for (std::size_t at = 0; at < bytes.size(); at += kPiece) {
    part.set_data(bytes.substr(at, kPiece));
    if (!stream->Write(part)) break;
  }
  stream->WritesDone();
  grpc::Status status = stream->Finish();
  model = response.model();
  return status;
}

class ModelTransferTest : public ::testing::Test {
 protected:
  ModelTransferTest() {
    EXPECT_TRUE(here_.train(train_request("block")).ok());
    EXPECT_TRUE(export_model(here_, "block", bytes_).ok());
  }

  RunningServer here_;
  RunningServer there_;
  std::string bytes_;
};

TEST_F(ModelTransferTest, AnImportedModelIsTheExportedOneUnderAnyId) {
  v1::Model model;
  const grpc::Status status = import_model(there_, "copy", bytes_, model);
  ASSERT_TRUE(status.ok()) << status.error_message();
  std::string again;
  ASSERT_TRUE(export_model(there_, "copy", again).ok());
  EXPECT_EQ(model.generation(), 1);
  EXPECT_EQ(again.size(), bytes_.size());
  const auto answers = there_.detect({detect_request("1", "copy")});
  const auto expected = here_.detect({detect_request("1", "block")});
  ASSERT_EQ(answers[0].hypotheses_size(), expected[0].hypotheses_size());
  ASSERT_GT(answers[0].hypotheses_size(), 0);
  EXPECT_EQ(answers[0].hypotheses(0).score(), expected[0].hypotheses(0).score());
}

TEST_F(ModelTransferTest, AnImportCountsTheGenerationOn) {
  v1::Model model;
  ASSERT_TRUE(import_model(here_, "block", bytes_, model).ok());
  EXPECT_EQ(model.generation(), 2);
}

TEST_F(ModelTransferTest, BytesThatAreNotWholeAreRefusedAndTheOldModelStays) {
  std::string flipped = bytes_;
  flipped[flipped.size() / 2] ^= 1;
  for (const std::string& bad : {flipped, bytes_.substr(0, bytes_.size() - 1), std::string("x"), std::string()}) {
    v1::Model model;
    const grpc::Status status = import_model(here_, "block", bad, model);
    EXPECT_FALSE(status.ok());
    EXPECT_FALSE(here_.detect({detect_request("1", "block")})[0].hypotheses().empty());
  }
}

TEST_F(ModelTransferTest, TheLimitOfAMessageIsThatOfAPieceNotOfTheModel) {
  const TemporaryDirectory directory;
  Config config = test_config(directory.path());
  config.max_message_mib = 1;
  RunningServer narrow(config);
  ASSERT_GT(bytes_.size(), std::size_t{1} << 20);
  v1::Model model;
  EXPECT_TRUE(import_model(narrow, "block", bytes_, model).ok());
  v1::ImportModelRequest whole;
  whole.set_id("block");
  whole.set_data(bytes_);
  grpc::ClientContext context;
  v1::ImportModelResponse response;
  const auto stream = narrow.models().ImportModel(&context, &response);
  stream->Write(whole);
  stream->WritesDone();
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("MiB; the server's limit, --max-message-mib, is 1"));
}

TEST_F(ModelTransferTest, WhatCannotBeIsToldByName) {
  std::string bytes;
  const grpc::Status unknown = export_model(here_, "ghost", bytes);
  EXPECT_EQ(unknown.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(unknown.error_message(), HasSubstr("ghost"));
  v1::Model model;
  EXPECT_EQ(import_model(here_, "a/b", bytes_, model).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace binpose::server

#include "server/tokens.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "server/log.h"
#include "tests/server/temporary_directory.h"

namespace binpose::server {
namespace {

class TokensTest : public ::testing::Test {
 protected:
  std::filesystem::path write(const char* text) {
    std::filesystem::path file = directory_.path() / "tokens";
    std::ofstream(file) << text;
    return file;
  }

  Tokens tokens_;

 private:
  TemporaryDirectory directory_;
};

TEST_F(TokensTest, WithoutAFileEverybodyIsLetIn) {
  ASSERT_TRUE(tokens_.load("").ok());
  EXPECT_TRUE(tokens_.check("", Role::kTrain).ok());
}

TEST_F(TokensTest, GiveEachRoleItsCallsAndNobodyElseAny) {
  ASSERT_TRUE(tokens_.load(write("# cell 4\ndetect aaaaaaaaaaaaaaaa\n\ntrain\tbbbbbbbbbbbbbbbb\r\n")).ok());
  EXPECT_TRUE(tokens_.check("Bearer aaaaaaaaaaaaaaaa", Role::kDetect).ok());
  EXPECT_EQ(tokens_.check("Bearer aaaaaaaaaaaaaaaa", Role::kTrain).code(), absl::StatusCode::kPermissionDenied);
  EXPECT_TRUE(tokens_.check("Bearer bbbbbbbbbbbbbbbb", Role::kDetect).ok());
  EXPECT_TRUE(tokens_.check("Bearer bbbbbbbbbbbbbbbb", Role::kTrain).ok());
  for (const char* wrong : {"", "Bearer ", "Bearer aaaaaaaaaaaaaaa", "Bearer aaaaaaaaaaaaaaaaa", "aaaaaaaaaaaaaaaa"}) {
    EXPECT_EQ(tokens_.check(wrong, Role::kDetect).code(), absl::StatusCode::kUnauthenticated) << wrong;
  }
}

TEST_F(TokensTest, AFileThatCannotBeUsedIsAnErrorThatNamesTheLineAndNoToken) {
  for (const char* text : {"detect short\n", "admin aaaaaaaaaaaaaaaa\n", "aaaaaaaaaaaaaaaa\n"}) {
    const absl::Status status = tokens_.load(write(text));
    EXPECT_NE(status.message().find("line 1"), std::string::npos) << status;
    EXPECT_EQ(status.message().find("aaaa"), std::string::npos) << status;
  }
}

TEST_F(TokensTest, AreReadAgainWhenTheFileChangesUnlessItIsWrong) {
  const auto file = write("detect aaaaaaaaaaaaaaaa\n");
  ASSERT_TRUE(tokens_.load(file).ok());
  const auto change = [&](const char* text, int seconds) {
    write(text);
    std::filesystem::last_write_time(file,
                                     std::filesystem::file_time_type::clock::now() + std::chrono::seconds(seconds));
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
  };
  change("detect cccccccccccccccc\n", 1);
  EXPECT_TRUE(tokens_.check("Bearer cccccccccccccccc", Role::kDetect).ok());
  EXPECT_FALSE(tokens_.check("Bearer aaaaaaaaaaaaaaaa", Role::kDetect).ok());
  change("nonsense\n", 2);
  EXPECT_TRUE(tokens_.check("Bearer cccccccccccccccc", Role::kDetect).ok());
}

TEST(TraceId, IsTakenFromATraceparentAndFromNothingElse) {
  EXPECT_EQ(trace_id_of("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"), "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(trace_id_of("00-4bf92f3577b34da6\"3ce929d0e0e4736-00f067aa0ba902b7-01"), "");
  EXPECT_EQ(trace_id_of("00-4bf9"), "");
  EXPECT_EQ(trace_id_of(""), "");
}

}  // namespace
}  // namespace binpose::server

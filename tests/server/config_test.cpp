#include "server/config.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "tests/server/temporary_directory.h"

namespace binpose::server {
namespace {

/// The configuration that arguments, separated by blanks, make; throws what CLI11 throws.
Config parse(const std::string& arguments) {
  Config config;
  CLI::App app;
  add_options(app, config);
  std::vector<std::string> words = absl::StrSplit(arguments, ' ');
  if (arguments.empty()) words.clear();
  app.parse(all_arguments(app, words));
  return config;
}

TEST(Config, ListensOnLoopbackOnlyUnlessToldOtherwise) {
  EXPECT_EQ(parse("").listen, "127.0.0.1:50051");
  EXPECT_EQ(parse("").metrics.substr(0, 10), "127.0.0.1:");
  EXPECT_EQ(parse("--listen 0.0.0.0:1").listen, "0.0.0.0:1");
}

TEST(Config, TakesEveryOption) {
  const Config config = parse(
      "--listen [::1]:0 --metrics localhost:9 --model-dir /m --threads 3 --queue 5 --max-message-mib 7 "
      "--drain-timeout 11 --write-timeout 12 --log-level debug");
  EXPECT_EQ(config.listen, "[::1]:0");
  EXPECT_EQ(config.metrics, "localhost:9");
  EXPECT_EQ(config.model_dir, "/m");
  EXPECT_EQ(config.threads, 3);
  EXPECT_EQ(config.queue, 5);
  EXPECT_EQ(config.max_message_mib, 7);
  EXPECT_EQ(config.drain_timeout_seconds, 11);
  EXPECT_EQ(config.write_timeout_seconds, 12);
  EXPECT_EQ(config.log_level, "debug");
}

/// Sets a variable of the environment while it lives.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) { ::setenv(name, value, 1); }
  ~Variable() { ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

TEST(Config, AFlagWinsOverTheEnvironmentAndTheEnvironmentOverTheFile) {
  const TemporaryDirectory directory;
  const std::string file = directory.path() / "server.toml";
  std::ofstream(file) << "threads = 3\nqueue = 4\nmax-message-mib = 5\ninsecure = true\n";
  const Variable queue("BINPOSE_QUEUE", "40");
  const Variable limit("BINPOSE_MAX_MESSAGE_MIB", "50");
  const Config config = parse("--max-message-mib 500 --config " + file);
  EXPECT_EQ(config.threads, 3);
  EXPECT_EQ(config.queue, 40);
  EXPECT_EQ(config.max_message_mib, 500);
  EXPECT_TRUE(config.insecure);
}

TEST(Config, AKeyInTheFileThatNothingKnowsIsAnError) {
  const TemporaryDirectory directory;
  const std::string file = directory.path() / "server.toml";
  std::ofstream(file) << "threds = 3\n";
  EXPECT_THROW(parse("--config " + file), CLI::ParseError);
}

TEST(CheckConfig, PlaintextBeyondLoopbackMustBeMeant) {
  EXPECT_TRUE(check(parse("--listen 127.0.0.1:1")).ok());
  EXPECT_TRUE(check(parse("--listen [::1]:1")).ok());
  EXPECT_TRUE(check(parse("--listen 0.0.0.0:1 --insecure")).ok());
  for (const char* address : {"0.0.0.0:1", "[::]:1", "robot:1", "192.168.0.1:1"}) {
    EXPECT_EQ(check(parse(std::string("--listen ") + address)).code(), absl::StatusCode::kInvalidArgument) << address;
  }
}

TEST(CheckConfig, NamesTheFileThatCannotBeUsed) {
  for (const char* arguments : {"--tls-cert /none/cert.pem --tls-key /none/key.pem", "--token-file /none/tokens"}) {
    const absl::Status status = check(parse(arguments));
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << arguments;
    EXPECT_NE(status.message().find("/none/"), std::string::npos) << status;
  }
  EXPECT_FALSE(check(parse("--tls-cert cert.pem")).ok());
  EXPECT_FALSE(check(parse("--tls-client-ca ca.pem")).ok());
}

TEST(Config, MetricsCanBeLeftOut) { EXPECT_EQ(parse("--metrics ").metrics, ""); }

TEST(Config, RefusesWhatCannotBe) {
  for (const char* arguments :
       {"--listen 50051", "--listen :50051", "--listen host:", "--listen host:65536", "--listen host:x", "--threads 0",
        "--threads many", "--queue 0", "--max-message-mib 0", "--max-message-mib 2048", "--drain-timeout -1",
        "--write-timeout 0", "--log-level loud", "--unknown", "positional"}) {
    EXPECT_THROW(parse(arguments), CLI::ParseError) << arguments;
  }
}

}  // namespace
}  // namespace binpose::server

#include "server/config.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"

namespace binpose::server {
namespace {

/// The configuration that arguments, separated by blanks, make; throws what CLI11 throws.
Config parse(const std::string& arguments) {
  Config config;
  CLI::App app;
  add_options(app, config);
  std::vector<std::string> words = absl::StrSplit(arguments, ' ');
  if (arguments.empty()) words.clear();
  std::reverse(words.begin(), words.end());  // as CLI11 wants them
  app.parse(words);
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
      "--drain-timeout 11 --log-level debug");
  EXPECT_EQ(config.listen, "[::1]:0");
  EXPECT_EQ(config.metrics, "localhost:9");
  EXPECT_EQ(config.model_dir, "/m");
  EXPECT_EQ(config.threads, 3);
  EXPECT_EQ(config.queue, 5);
  EXPECT_EQ(config.max_message_mib, 7);
  EXPECT_EQ(config.drain_timeout_seconds, 11);
  EXPECT_EQ(config.log_level, "debug");
}

TEST(Config, MetricsCanBeLeftOut) { EXPECT_EQ(parse("--metrics ").metrics, ""); }

TEST(Config, RefusesWhatCannotBe) {
  for (const char* arguments :
       {"--listen 50051", "--listen :50051", "--listen host:", "--listen host:65536", "--listen host:x", "--threads 0",
        "--threads many", "--queue 0", "--max-message-mib 0", "--max-message-mib 2048", "--drain-timeout -1",
        "--log-level loud", "--unknown", "positional"}) {
    EXPECT_THROW(parse(arguments), CLI::ParseError) << arguments;
  }
}

}  // namespace
}  // namespace binpose::server

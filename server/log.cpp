#include "server/log.h"

#include <google/protobuf/stubs/logging.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <mutex>
#include <utility>

#include "absl/strings/str_format.h"
#include "server/clock.h"

namespace binpose::server {
namespace {

thread_local std::string trace_id;    // NOLINT(*-avoid-non-const-global-variables): what the thread works for
thread_local std::string request_id;  // NOLINT(*-avoid-non-const-global-variables)

/// protobuf reports what it cannot parse; bytes that a client sends are no event of the server's.
void log_protobuf(google::protobuf::LogLevel /*level*/, const char* /*file*/, int /*line*/,
                  const std::string& message) {
  spdlog::debug("protobuf: {}", message);
}

std::string json_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      quoted += absl::StrFormat("\\u%04x", static_cast<unsigned char>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

/// One JSON object with the message and, where known, whom it is about.
class JsonMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/, spdlog::memory_buf_t& line) override {
    std::string fields = json_string({message.payload.data(), message.payload.size()});
    if (!trace_id.empty()) fields += ",\"trace_id\":" + json_string(trace_id);
    if (!request_id.empty()) fields += ",\"request_id\":" + json_string(request_id);
    line.append(fields.data(), fields.data() + fields.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JsonMessage>(); }
};

/// The message as one line of text, with whom it is about.
class TextMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/, spdlog::memory_buf_t& line) override {
    std::string text(message.payload.data(), message.payload.size());
    if (!trace_id.empty()) text += " trace_id=" + trace_id;
    if (!request_id.empty()) text += " request_id=" + json_string(request_id);
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<TextMessage>(); }
};

std::unique_ptr<spdlog::formatter> formatter(LogFormat format) {
  auto pattern = std::make_unique<spdlog::pattern_formatter>();
  if (format == LogFormat::kJson) {
    pattern->add_flag<JsonMessage>('*');
    pattern->set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l","message":%*})");
  } else {
    pattern->add_flag<TextMessage>('*');
    pattern->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %*");
  }
  return pattern;
}

/// Lets a number of lines a second through and counts the rest.
class RateLimit {
 public:
  /// Lines that were held back since the last that passed; -1: hold this one back as well.
  int pass() {
    constexpr int kLinesPerSecond = 10;
    const std::lock_guard lock(mutex_);
    if (seconds_since(second_) >= 1) {
      second_ = Clock::now();
      lines_ = 0;
    }
    if (++lines_ <= kLinesPerSecond) return std::exchange(held_back_, 0);
    ++held_back_;
    return -1;
  }

 private:
  std::mutex mutex_;
  Clock::time_point second_;
  int lines_ = 0;
  int held_back_ = 0;
};

}  // namespace

void log_to_stderr(const std::string& level, LogFormat format) {
  auto logger = std::make_shared<spdlog::logger>("binpose", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_level(spdlog::level::from_str(level));
  logger->set_formatter(formatter(format));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
  google::protobuf::SetLogHandler(log_protobuf);
}

std::string trace_id_of(const grpc::CallbackServerContext& context) {
  const auto found = context.client_metadata().find("traceparent");
  if (found == context.client_metadata().end()) return "";
  return trace_id_of(std::string_view(found->second.data(), found->second.size()));
}

std::string trace_id_of(std::string_view traceparent) {
  constexpr std::size_t kStart = 3;  // after "00-"
  constexpr std::size_t kLength = 32;
  if (traceparent.size() < kStart + kLength + 1 || traceparent[2] != '-' || traceparent[kStart + kLength] != '-') {
    return "";
  }
  const std::string_view id = traceparent.substr(kStart, kLength);
  return id.find_first_not_of("0123456789abcdef") == std::string_view::npos ? std::string(id) : "";
}

LogTrace::LogTrace(std::string_view id) { trace_id = id; }
LogTrace::~LogTrace() { trace_id.clear(); }
LogRequest::LogRequest(std::string_view id) { request_id = id; }
LogRequest::~LogRequest() { request_id.clear(); }

void log_failure(std::string_view what, const absl::Status& status) {
  if (absl::IsCancelled(status)) return;  // the caller's wish
  static RateLimit limit;
  const int held_back = limit.pass();
  if (held_back < 0) return;
  const std::string reason(status.message());
  if (held_back > 0) spdlog::warn("{} more failures were not logged", held_back);
  spdlog::warn("{} failed: {}: {}", what, absl::StatusCodeToString(status.code()), reason);
}

}  // namespace binpose::server

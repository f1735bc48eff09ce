#include "client/detect_stream.h"

#include <utility>

#include "client/call_error.h"

namespace binpose::client {

DetectStream::DetectStream(v1::DetectionService::Stub& service, std::string server,
                           std::chrono::milliseconds answer_timeout)
    : server_(std::move(server)),
      answer_timeout_(answer_timeout),
      stream_(service.Detect(&context_)),
      answer_taker_([this] { take_answers(); }) {}

DetectStream::~DetectStream() {
  cancel();
  answer_taker_.join();
}

absl::Status DetectStream::write(const v1::DetectRequest& request) {
  if (stream_->Write(request)) return absl::OkStatus();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return end_.has_value(); });
  if (absl::Status status = this->status(); !status.ok()) return status;
  return absl::UnavailableError("The server at " + server_ + " has ended the stream of scans; open a new one.");
}

void DetectStream::done_writing() {
  if (std::exchange(is_done_writing_, true)) return;
  stream_->WritesDone();
}

std::optional<v1::DetectResponse> DetectStream::read() {
  std::unique_lock lock(mutex_);
  const auto has_news = [this] { return !answers_.empty() || end_.has_value(); };
  if (!changed_.wait_for(lock, answer_timeout_, has_news)) {
    is_timed_out_ = true;
    context_.TryCancel();
    changed_.wait(lock, has_news);
  }
  if (answers_.empty()) return std::nullopt;
  v1::DetectResponse answer = std::move(answers_.front());
  answers_.pop_front();
  return answer;
}

absl::Status DetectStream::finish() {
  done_writing();
  while (read().has_value()) {
  }
  const std::lock_guard lock(mutex_);
  return status();
}

void DetectStream::cancel() { context_.TryCancel(); }

void DetectStream::take_answers() {
  v1::DetectResponse answer;
  while (stream_->Read(&answer)) {
    const std::lock_guard lock(mutex_);
    answers_.push_back(std::move(answer));
    changed_.notify_all();
  }
  const grpc::Status end = stream_->Finish();
  const std::lock_guard lock(mutex_);
  end_ = end;
  changed_.notify_all();
}

absl::Status DetectStream::status() const {
  const grpc::Status timed_out(grpc::StatusCode::DEADLINE_EXCEEDED, "");
  return call_error(is_timed_out_ ? timed_out : *end_, {"Detection", server_});
}

}  // namespace binpose::client

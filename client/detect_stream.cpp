#include "client/detect_stream.h"

#include <algorithm>
#include <utility>

#include "client/call_error.h"

namespace binpose::client {
DetectStream::DetectStream(std::shared_ptr<Servers> servers, std::chrono::milliseconds answer_timeout,
                           const Retries& retries)
    : servers_(std::move(servers)), answer_timeout_(answer_timeout), retries_(retries), runner_([this] { run(); }) {}

DetectStream::~DetectStream() {
  cancel();
  runner_.join();
}

absl::Status DetectStream::write(Scan scan) {
  std::unique_lock lock(mutex_);
  const std::uint64_t number = written_;
  if (!end_) {
    unanswered_.push_back(std::move(scan));
    ++written_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return std::max(sent_, answered_) > number || end_.has_value(); });
  }
  if (std::max(sent_, answered_) > number) return absl::OkStatus();
  if (absl::Status status = this->status(); !status.ok()) return status;
  return absl::UnavailableError("The server at " + servers_->name() +
                                " has ended the stream of scans; open a new one.");
}

void DetectStream::done_writing() {
  const std::lock_guard lock(mutex_);
  is_done_writing_ = true;
  changed_.notify_all();
}

std::optional<v1::DetectResponse> DetectStream::read() {
  std::unique_lock lock(mutex_);
  const auto has_news = [this] { return !answers_.empty() || end_.has_value(); };
  if (!changed_.wait_for(lock, answer_timeout_, has_news)) {
    is_timed_out_ = true;
    lock.unlock();
    cancel();
    lock.lock();
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

void DetectStream::cancel() {
  const std::lock_guard lock(mutex_);
  is_cancelled_ = true;
  if (attempt_ != nullptr) attempt_->context.TryCancel();
  changed_.notify_all();
}

/// The thread of the stream: opens it, takes the answers, and opens it again.
void DetectStream::run() {
  int failures = 0;
  while (wait_for_work()) {
    const Stubs& server = servers_->current();
    bool was_answered = false;
    const grpc::Status status = attempt(server, was_answered);
    if (was_answered) failures = 0;
    if (!is_lost(status) || ++failures > retries_.attempts) return end(status);
    servers_->leave(server);
    if (!wait_before(failures)) return end(grpc::Status::CANCELLED);
  }
}

/// False when the stream has ended.
bool DetectStream::wait_for_work() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return is_cancelled_ || is_done_writing_ || !unanswered_.empty(); });
  if (!is_cancelled_ && !unanswered_.empty()) return true;
  end_ = is_cancelled_ ? grpc::Status::CANCELLED : grpc::Status::OK;
  changed_.notify_all();
  return false;
}

/// Makes one call, sends what is not answered and takes the answers until the call ends; how it did.
grpc::Status DetectStream::attempt(const Stubs& server, bool& was_answered) {
  Attempt attempt;
  {
    const std::lock_guard lock(mutex_);
    const v1::DetectRequest& first = *unanswered_.front();
    if (!first.model_ids().empty()) set_routing_key(first.model_ids(0), attempt.context);
    attempt.next = answered_;
    attempt_ = &attempt;
    if (is_cancelled_) attempt.context.TryCancel();
  }
  attempt.stream = open_detect(server, attempt.context);
  // Beside the reading: the server takes no more scans while its answers are not taken.
  std::thread sender([&] { send(attempt); });
  v1::DetectResponse answer;
  while (attempt.stream->Read(&answer)) {
    take(std::move(answer), attempt);
    was_answered = true;
  }
  {
    const std::lock_guard lock(mutex_);
    attempt.is_over = true;
    changed_.notify_all();
  }
  sender.join();
  const grpc::Status status = attempt.stream->Finish();
  const std::lock_guard lock(mutex_);
  attempt_ = nullptr;
  return is_cancelled_ ? grpc::Status::CANCELLED : status;
}

void DetectStream::send(Attempt& attempt) {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return attempt.is_over || attempt.next < written_ || is_done_writing_; });
    if (attempt.is_over) return;
    if (attempt.next == written_) break;
    const Scan scan = unanswered_[attempt.next++ - answered_];
    const std::uint64_t sent = attempt.next;
    lock.unlock();
    const grpc::ByteBuffer bytes = encode(scan);
    if (!bytes.Valid() || !attempt.stream->Write(bytes)) return;
    lock.lock();
    sent_ = std::max(sent_, sent);
    changed_.notify_all();
  }
  lock.unlock();
  attempt.stream->WritesDone();
}

void DetectStream::take(v1::DetectResponse answer, const Attempt& attempt) {
  const std::lock_guard lock(mutex_);
  answers_.push_back(std::move(answer));
  if (answered_ < attempt.next) {
    unanswered_.pop_front();
    ++answered_;
  }
  changed_.notify_all();
}

/// Waits for the server to be connected, or as long as the pause; gRPC attends to a connection every five seconds only,
/// unless somebody waits for it. False when the stream was cancelled meanwhile.
bool DetectStream::wait_before(int attempt) {
  using Clock = std::chrono::system_clock;
  constexpr std::chrono::milliseconds kLongestWait(50);  // for a cancel to be noticed
  grpc::Channel& channel = *servers_->current().channel;
  const bool is_connected = channel.GetState(true) == GRPC_CHANNEL_READY;
  const Clock::time_point end = Clock::now() + pause_before(attempt, retries_);
  std::unique_lock lock(mutex_);
  if (is_connected) changed_.wait_until(lock, end, [this] { return is_cancelled_; });
  while (!is_cancelled_ && Clock::now() < end) {
    lock.unlock();
    const bool is_connected_now = channel.WaitForConnected(std::min(end, Clock::now() + kLongestWait));
    lock.lock();
    if (is_connected_now) break;
  }
  return !is_cancelled_;
}

void DetectStream::end(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  end_ = status;
  changed_.notify_all();
}

absl::Status DetectStream::status() const {
  const grpc::Status timed_out(grpc::StatusCode::DEADLINE_EXCEEDED, "");
  return call_error(is_timed_out_ ? timed_out : *end_, {"Detection", servers_->name()});
}

}  // namespace binpose::client

#include "server/detect_stream.h"

namespace binpose::server {

DetectStream::DetectStream(FrameHandler& handler, ComputePool& pool, Drain& drain, prometheus::Gauge& open_streams,
                           std::optional<Clock::time_point> deadline)
    : handler_(handler), pool_(pool), open_streams_(open_streams), deadline_(deadline), call_(drain) {
  open_streams_.Increment();
  advance([] {});
  call_.when_draining([this] { advance([this] { draining_ = true; }); });
}

void DetectStream::OnReadDone(bool ok) {
  Frame* frame = nullptr;
  advance([&] {
    reading_ = false;
    if (!ok) {
      input_ended_ = true;
    } else if (!finished_) {
      frame = &frames_.emplace_back();
      frame->bytes.Swap(&incoming_);
    }
  });
  if (frame != nullptr) submit(*frame);
}

void DetectStream::OnWriteDone(bool /*ok*/) {
  // A failed write means a broken stream; the read that fails as well ends it.
  advance([this] {
    writing_ = false;
    frames_.pop_front();
  });
}

void DetectStream::submit(Frame& frame) {
  const absl::Status admitted = pool_.submit([this, &frame] {
    const RunControl control = {.stop = stop_.get_token(), .deadline = deadline_, .threads = pool_.fair_share()};
    set_answer(frame, handler_.answer(frame.bytes, frame.arrival, control));
  });
  if (!admitted.ok()) set_answer(frame, handler_.refuse(frame.bytes, admitted));
}

void DetectStream::set_answer(Frame& frame, grpc::ByteBuffer answer) {
  advance([&] {
    frame.bytes.Swap(&answer);
    frame.answered = true;
  });
}

/// Makes a change and starts what it has made possible. The last action of whoever calls: once the lock is open,
/// another thread may end the call, and the stream is gone.
template <class Change>
void DetectStream::advance(Change change) {
  const grpc::ByteBuffer* write = nullptr;
  bool read = false;
  bool finish = false;
  bool draining = false;
  {
    const std::lock_guard lock(mutex_);
    change();
    if (!writing_ && !frames_.empty() && frames_.front().answered) {
      writing_ = true;
      write = &frames_.front().bytes;
    }
    if (!reading_ && !input_ended_ && !draining_ && frames_.size() < kMaxUnanswered) read = reading_ = true;
    if (!finished_ && frames_.empty() && (input_ended_ || draining_)) finish = finished_ = true;
    draining = draining_ && !input_ended_;
  }
  if (write != nullptr) StartWrite(write);
  if (read) StartRead(&incoming_);
  if (finish) Finish(draining ? grpc::Status(grpc::StatusCode::UNAVAILABLE, kEnding) : grpc::Status::OK);
}

}  // namespace binpose::server

#include "server/detect_stream.h"

#include <utility>

#include "server/log.h"

namespace binpose::server {

DetectStream::DetectStream(const Surroundings& surroundings, grpc::CallbackServerContext& context,
                           std::optional<Clock::time_point> deadline, std::string trace_id)
    : around_(surroundings),
      context_(context),
      deadline_(deadline),
      trace_id_(std::move(trace_id)),
      call_(surroundings.drain) {
  around_.open_streams.Increment();
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
  around_.writes.end(context_);
  // A failed write means a broken stream; the read that fails as well ends it.
  advance([this] {
    writing_ = false;
    frames_.pop_front();
  });
}

void DetectStream::OnCancel() {
  cancel_time_ = Clock::now();
  stop_.request_stop();
  around_.pool.run_stopped();
}

void DetectStream::submit(Frame& frame) {
  absl::StatusOr<MemoryBudget::Share> memory = around_.memory.take(frame.bytes.Length());
  absl::Status admitted = memory.status();
  if (admitted.ok()) {
    frame.memory = *std::move(memory);
    admitted =
        around_.pool.submit([this, &frame] { compute(frame); }, {.stop = stop_.get_token(), .deadline = deadline_});
  }
  if (!admitted.ok()) set_answer(frame, around_.handler.refuse(frame.bytes, admitted));
}

void DetectStream::compute(Frame& frame) {
  const LogTrace log_trace(trace_id_);
  const RunControl control = {.stop = stop_.get_token(), .deadline = deadline_, .threads = around_.pool.fair_share()};
  const CancelPlace place = control.stop.stop_requested() ? CancelPlace::kQueue : CancelPlace::kCompute;
  grpc::ByteBuffer answer = around_.handler.answer(frame.bytes, frame.arrival, control);
  if (control.stop.stop_requested()) around_.handler.note_cancel(place, seconds_since(cancel_time_));
  set_answer(frame, answer);
}

void DetectStream::set_answer(Frame& frame, grpc::ByteBuffer answer) {
  advance([&] {
    frame.bytes.Swap(&answer);
    frame.memory = {};
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
  if (write != nullptr) {
    around_.writes.begin(context_);
    StartWrite(write);
  }
  if (read) StartRead(&incoming_);
  if (finish) Finish(draining ? grpc::Status(grpc::StatusCode::UNAVAILABLE, kEnding) : grpc::Status::OK);
}

}  // namespace binpose::server

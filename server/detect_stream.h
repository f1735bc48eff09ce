#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <prometheus/gauge.h>

#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>

#include "absl/status/status.h"
#include "core/run_control.h"
#include "server/clock.h"
#include "server/compute_pool.h"
#include "server/drain.h"

namespace binpose::server {

/// Frames that are read before the first of them is answered; then reading pauses, and the client's writes with it.
inline constexpr std::size_t kMaxUnanswered = 2;

/// What a stream's frames are answered by. Frames are bytes, so that one that cannot be decoded is answered as well.
class FrameHandler {
 public:
  virtual ~FrameHandler() = default;
  /// Computes the answer; on a thread of the pool, at most kMaxUnanswered at a time for a stream.
  virtual grpc::ByteBuffer answer(grpc::ByteBuffer& frame, Clock::time_point arrival, const RunControl& control) = 0;
  /// The answer to a frame that is not computed; quick, because a thread of gRPC's asks.
  virtual grpc::ByteBuffer refuse(grpc::ByteBuffer& frame, const absl::Status& reason) = 0;
};

/// One Detect call: any number of frames, answered in order. Deletes itself when the call is over. While it drains,
/// what has been read is answered, then the call ends with UNAVAILABLE.
class DetectStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  /// @param open_streams  counts this one while it lives. It, handler, pool and drain outlive the stream.
  DetectStream(FrameHandler& handler, ComputePool& pool, Drain& drain, prometheus::Gauge& open_streams,
               std::optional<Clock::time_point> deadline);
  ~DetectStream() override { open_streams_.Decrement(); }

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override { stop_.request_stop(); }
  void OnDone() override { delete this; }

 private:
  struct Frame {
    grpc::ByteBuffer bytes;  ///< the request, then its answer
    Clock::time_point arrival = Clock::now();
    bool answered = false;
  };

  void submit(Frame& frame);
  void set_answer(Frame& frame, grpc::ByteBuffer answer);
  template <class Change>
  void advance(Change change);

  FrameHandler& handler_;
  ComputePool& pool_;
  prometheus::Gauge& open_streams_;
  const std::optional<Clock::time_point> deadline_;
  std::stop_source stop_;
  grpc::ByteBuffer incoming_;

  std::mutex mutex_;  ///< guards what follows
  std::deque<Frame> frames_;
  bool reading_ = false;
  bool writing_ = false;
  bool input_ended_ = false;
  bool draining_ = false;
  bool finished_ = false;

  Drain::Call call_;  ///< last, so that its action ends before the rest goes
};

}  // namespace binpose::server

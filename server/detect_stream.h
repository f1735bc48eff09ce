#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <prometheus/gauge.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "core/run_control.h"
#include "server/clock.h"
#include "server/compute_pool.h"
#include "server/drain.h"
#include "server/memory_budget.h"
#include "server/write_watch.h"

namespace binpose::server {

/// Frames that are read before the first of them is answered; then reading pauses, and the client's writes with it.
inline constexpr std::size_t kMaxUnanswered = 2;

/// Where a cancel caught a frame.
enum class CancelPlace { kQueue, kCompute };

/// What a stream's frames are answered by. Frames are bytes, so that one that cannot be decoded is answered as well.
class FrameHandler {
 public:
  virtual ~FrameHandler() = default;
  /// Computes the answer; on a thread of the pool, at most kMaxUnanswered at a time for a stream.
  virtual grpc::ByteBuffer answer(grpc::ByteBuffer& frame, Clock::time_point arrival, const RunControl& control) = 0;
  /// The answer to a frame that is not computed; quick, because a thread of gRPC's asks.
  virtual grpc::ByteBuffer refuse(grpc::ByteBuffer& frame, const absl::Status& reason) = 0;
  /// Told that a frame of a cancelled call ended, that long after the cancel.
  virtual void note_cancel(CancelPlace place, double seconds) = 0;
};

/// One Detect call: any number of frames, answered in order. Deletes itself when the call is over. While it drains,
/// what has been read is answered, then the call ends with UNAVAILABLE.
class DetectStream final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  /// What a stream works with; outlives it.
  struct Surroundings {
    FrameHandler& handler;
    ComputePool& pool;
    MemoryBudget& memory;  ///< holds the frames until they are answered
    Drain& drain;
    WriteWatch& writes;
    prometheus::Gauge& open_streams;  ///< counts this stream while it lives
  };

  /// @param context   of the call; lives as long as it does.
  /// @param trace_id  goes into the log beside what concerns the stream.
  DetectStream(const Surroundings& surroundings, grpc::CallbackServerContext& context,
               std::optional<Clock::time_point> deadline, std::string trace_id);
  ~DetectStream() override { around_.open_streams.Decrement(); }

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override { delete this; }

 private:
  struct Frame {
    grpc::ByteBuffer bytes;  ///< the request, then its answer
    MemoryBudget::Share memory;
    Clock::time_point arrival = Clock::now();
    bool answered = false;
  };

  void submit(Frame& frame);
  void compute(Frame& frame);
  void set_answer(Frame& frame, grpc::ByteBuffer answer);
  template <class Change>
  void advance(Change change);

  const Surroundings around_;
  grpc::CallbackServerContext& context_;
  const std::optional<Clock::time_point> deadline_;
  const std::string trace_id_;
  std::atomic<Clock::time_point> cancel_time_ = Clock::time_point::max();  ///< set before the stop is requested
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

#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "absl/status/status.h"
#include "binpose/v1/detection_service.pb.h"
#include "client/connection.h"
#include "client/encode_scan.h"
#include "client/servers.h"

namespace binpose::client {

/// A stream of scans to search: one answer a scan, in order.
///
/// Answers are taken off the wire by a thread of the stream's own and kept until they are read. So any number of scans
/// can be written before the first answer is read, although the server takes no more than two ahead of its answers.
/// One thread may write while another reads.
///
/// A stream that is lost, or whose server ends to be replaced, is opened again, elsewhere where there are several
/// servers, and the scans that were not answered are sent again, as Retries say.
class DetectStream {
 public:
  /// Opened with the first scan, whose first model a balancer may choose the server by.
  ///
  /// @param answer_timeout  the longest that read() waits, lost streams included.
  DetectStream(std::shared_ptr<Servers> servers, std::chrono::milliseconds answer_timeout, const Retries& retries);

  /// Cancels what was not finished.
  ~DetectStream();

  DetectStream(const DetectStream&) = delete;
  DetectStream& operator=(const DetectStream&) = delete;

  /// Sends a scan; waits while the server has enough to do. An error means that the stream has ended, and why.
  absl::Status write(Scan scan);
  absl::Status write(v1::DetectRequest request) {
    return write(std::make_shared<const v1::DetectRequest>(std::move(request)));
  }

  /// Says that no more scans will come; the answers of those written still do.
  void done_writing();

  /// The next answer; waits for it. Nothing: the stream has ended, and finish() says why. A wait beyond the time-out
  /// ends the stream with DEADLINE_EXCEEDED.
  std::optional<v1::DetectResponse> read();

  /// Waits until the server ends the stream; OK when it answered every scan. Answers that were not read are dropped.
  absl::Status finish();

  /// Ends the stream at once; from any thread.
  void cancel();

 private:
  /// One call to the server.
  struct Attempt {
    grpc::ClientContext context;
    std::unique_ptr<DetectCall> stream;
    std::uint64_t next = 0;  ///< the scan to send next, by its number
    bool is_over = false;
  };

  void run();
  bool wait_for_work();
  grpc::Status attempt(const Stubs& server, bool& was_answered);
  void send(Attempt& attempt);
  void take(v1::DetectResponse answer, const Attempt& attempt);
  bool wait_before(int attempt);
  void end(const grpc::Status& status);
  absl::Status status() const;

  const std::shared_ptr<Servers> servers_;
  const std::chrono::milliseconds answer_timeout_;
  const Retries retries_;

  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable changed_;
  std::deque<Scan> unanswered_;  ///< that were written, those numbered `answered_` to `written_`
  std::uint64_t written_ = 0;
  std::uint64_t sent_ = 0;
  std::uint64_t answered_ = 0;
  std::deque<v1::DetectResponse> answers_;  ///< that were not read
  Attempt* attempt_ = nullptr;
  std::optional<grpc::Status> end_;  ///< set when the stream has ended for good
  bool is_done_writing_ = false;
  bool is_cancelled_ = false;
  bool is_timed_out_ = false;

  std::thread runner_;  ///< last, for it uses all of the above
};

}  // namespace binpose::client

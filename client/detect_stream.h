#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "binpose/v1/detection_service.grpc.pb.h"

namespace binpose::client {

/// A stream of scans to search: one answer a scan, in order.
///
/// Answers are taken off the wire by a thread of the stream's own and kept until they are read. So any number of scans
/// can be written before the first answer is read, although the server takes no more than two ahead of its answers.
/// One thread may write while another reads.
class DetectStream {
 public:
  /// `server`: HOST:PORT, for messages. `answer_timeout`: the longest that read() waits.
  DetectStream(v1::DetectionService::Stub& service, std::string server, std::chrono::milliseconds answer_timeout);

  /// Cancels what was not finished.
  ~DetectStream();

  DetectStream(const DetectStream&) = delete;
  DetectStream& operator=(const DetectStream&) = delete;

  /// Sends a scan; waits while the server has enough to do. An error means that the stream has ended, and why.
  absl::Status write(const v1::DetectRequest& request);

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
  void take_answers();
  absl::Status status() const;

  const std::string server_;
  const std::chrono::milliseconds answer_timeout_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::DetectRequest, v1::DetectResponse>> stream_;
  bool is_done_writing_ = false;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<v1::DetectResponse> answers_;
  std::optional<grpc::Status> end_;  ///< set when the server has ended the stream
  bool is_timed_out_ = false;

  std::thread answer_taker_;  ///< last, for it uses all of the above
};

}  // namespace binpose::client

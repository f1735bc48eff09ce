#pragma once

#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "binpose/v1/model_service.pb.h"
#include "server/backend.h"
#include "server/clock.h"

namespace binpose::server {

/// One Train call: trains on the pool, reports progress, saves. Deletes itself when the call is over.
class TrainCall final : public grpc::ServerWriteReactor<v1::TrainResponse> {
 public:
  /// @param request  lives until OnDone(), as does `context`.
  /// @param allowed  an error ends the call with it.
  TrainCall(const v1::TrainRequest& request, const Backend& backend, grpc::CallbackServerContext& context,
            const absl::Status& allowed);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override { delete this; }

 private:
  absl::Status admit(const absl::Status& allowed);
  void run();
  absl::StatusOr<v1::Model> train_and_save();
  void report(v1::TrainStage stage, double progress);
  void end(const absl::StatusOr<v1::Model>& outcome);
  template <class Change>
  void advance(Change change);

  const v1::TrainRequest& request_;
  Backend backend_;
  grpc::CallbackServerContext& context_;
  const std::optional<Clock::time_point> deadline_;
  const Clock::time_point arrival_ = Clock::now();
  const std::string trace_id_;
  MemoryBudget::Share memory_;
  std::atomic<Clock::time_point> cancel_time_ = Clock::time_point::max();  ///< set before the stop is requested
  std::stop_source stop_;
  v1::TrainResponse outgoing_;

  std::mutex mutex_;                          ///< guards what follows
  std::optional<v1::TrainResponse> pending_;  ///< the latest news; older ones that a slow reader kept waiting are gone
  std::optional<grpc::Status> end_;           ///< set when nothing more will be reported
  bool writing_ = false;
  bool finished_ = false;

  Drain::Call call_;
};

}  // namespace binpose::server

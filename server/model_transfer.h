#pragma once

#include <grpcpp/support/server_callback.h>

#include <string>
#include <string_view>

#include "binpose/v1/model_service.pb.h"
#include "server/backend.h"
#include "server/clock.h"

/// Models on their way from one server to another.
namespace binpose::server {

/// One ExportModel call. Deletes itself when the call is over.
class ExportCall final : public grpc::ServerWriteReactor<v1::ExportModelResponse> {
 public:
  /// @param allowed  an error ends the call with it.
  ExportCall(const std::string& id, const Backend& backend, grpc::CallbackServerContext& context,
             const absl::Status& allowed);

  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  absl::Status prepare(const std::string& id);
  void write_next();
  void end(const absl::Status& status);

  Backend backend_;
  grpc::CallbackServerContext& context_;
  const Clock::time_point arrival_ = Clock::now();
  std::string bytes_;
  std::size_t sent_ = 0;
  v1::ExportModelResponse outgoing_;
  Drain::Call call_;
};

/// One ImportModel call. Deletes itself when the call is over.
class ImportCall final : public grpc::ServerReadReactor<v1::ImportModelRequest> {
 public:
  /// @param response  lives until OnDone().
  /// @param allowed   an error ends the call with it.
  ImportCall(v1::ImportModelResponse& response, const Backend& backend, const absl::Status& allowed);

  void OnReadDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  absl::Status take(const v1::ImportModelRequest& part);
  absl::Status save();
  void end(const absl::Status& status);

  v1::ImportModelResponse& response_;
  Backend backend_;
  const Clock::time_point arrival_ = Clock::now();
  v1::ImportModelRequest incoming_;
  std::string id_;
  std::string bytes_;
  MemoryBudget::Share memory_;
  Drain::Call call_;
};

}  // namespace binpose::server

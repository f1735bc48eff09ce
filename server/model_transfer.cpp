#include "server/model_transfer.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"
#include "server/convert_training.h"
#include "server/model_envelope.h"
#include "server/status.h"

namespace binpose::server {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

}  // namespace

ExportCall::ExportCall(const std::string& id, const Backend& backend, grpc::CallbackServerContext& context,
                       const absl::Status& allowed)
    : backend_(backend), context_(context), call_(backend.drain) {
  absl::Status status = allowed;
  if (status.ok() && backend_.drain.started()) status = absl::UnavailableError(kEnding);
  if (status.ok()) status = check_model_id("id", id);
  if (status.ok()) {
    status = backend_.detections.submit([this, id] {
      const absl::Status prepared = contain_exceptions([&] { return prepare(id); });
      prepared.ok() ? write_next() : end(prepared);
    });
  }
  if (!status.ok()) end(status);
}

absl::Status ExportCall::prepare(const std::string& id) {
  const auto stored = backend_.models.find(id);
  if (!stored.ok()) return stored.status();
  bytes_ = seal_envelope(**stored);
  return absl::OkStatus();
}

void ExportCall::write_next() {
  if (sent_ == bytes_.size()) return end(absl::OkStatus());
  const std::size_t count = std::min(kPieceBytes, bytes_.size() - sent_);
  outgoing_.set_data(bytes_.substr(sent_, count));
  sent_ += count;
  backend_.writes.begin(context_);
  StartWrite(&outgoing_);
}

void ExportCall::OnWriteDone(bool ok) {
  backend_.writes.end(context_);
  ok ? write_next() : end(absl::CancelledError("The caller is gone."));
}

void ExportCall::end(const absl::Status& status) {
  backend_.metrics.count_request(Method::kExportModel, status.code(), seconds_since(arrival_));
  Finish(to_grpc(status));
}

ImportCall::ImportCall(v1::ImportModelResponse& response, const Backend& backend, const absl::Status& allowed)
    : response_(response), backend_(backend), call_(backend.drain) {
  absl::Status status = allowed;
  if (status.ok() && backend_.drain.started()) status = absl::UnavailableError(kEnding);
  status.ok() ? StartRead(&incoming_) : end(status);
}

void ImportCall::OnReadDone(bool ok) {
  absl::Status status;
  if (ok) {
    status = contain_exceptions([this] { return take(incoming_); });
    if (status.ok()) return StartRead(&incoming_);
  } else {
    status = backend_.detections.submit([this] { end(contain_exceptions([this] { return save(); })); });
    if (status.ok()) return;
  }
  end(status);
}

absl::Status ImportCall::take(const v1::ImportModelRequest& part) {
  if (bytes_.empty() && id_.empty()) {
    id_ = part.id();
    if (absl::Status status = check_model_id("id", id_); !status.ok()) return status;
  }
  const std::size_t size = bytes_.size() + part.data().size();
  if (size > kMaxModelFileBytes) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("data has more than %d bytes in all; that is the limit.", kMaxModelFileBytes));
  }
  absl::StatusOr<MemoryBudget::Share> memory = backend_.requests.take(part.ByteSizeLong());
  if (!memory.ok()) return memory.status();
  memory_.add(*std::move(memory));
  bytes_ += part.data();
  return absl::OkStatus();
}

absl::Status ImportCall::save() {
  if (absl::Status status = check_model_id("id", id_); !status.ok()) return status;
  absl::StatusOr<StoredModel> model = open_envelope(id_, bytes_);
  if (!model.ok()) return in_field("data", model.status());
  const auto stored = backend_.models.put(id_, std::move(model->model));
  if (!stored.ok()) return stored.status();
  *response_.mutable_model() = to_proto(**stored);
  spdlog::info("imported {} generation {}", id_, (*stored)->generation);
  return absl::OkStatus();
}

void ImportCall::end(const absl::Status& status) {
  backend_.metrics.count_request(Method::kImportModel, status.code(), seconds_since(arrival_));
  Finish(to_grpc(status));
}

}  // namespace binpose::server

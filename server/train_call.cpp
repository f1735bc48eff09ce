#include "server/train_call.h"

#include <spdlog/spdlog.h>

#include <string>
#include <utility>

#include "core/train/train.h"
#include "server/convert_training.h"
#include "server/log.h"
#include "server/status.h"

namespace binpose::server {
namespace {

/// Share of the progress that core's part of the work takes.
constexpr double kComputeShare = 0.95;

}  // namespace

TrainCall::TrainCall(const v1::TrainRequest& request, const Backend& backend, grpc::CallbackServerContext& context,
                     const absl::Status& allowed)
    : request_(request),
      backend_(backend),
      context_(context),
      deadline_(compute_deadline(context.deadline())),
      trace_id_(trace_id_of(context)),
      call_(backend.drain) {
  if (const absl::Status admitted = admit(allowed); !admitted.ok()) {
    backend_.metrics.count_refusal(admitted);
    end(admitted);
  }
}

absl::Status TrainCall::admit(const absl::Status& allowed) {
  if (!allowed.ok()) return allowed;
  if (backend_.drain.started()) return absl::UnavailableError(kEnding);
  absl::StatusOr<MemoryBudget::Share> memory = backend_.requests.take(request_.ByteSizeLong());
  if (!memory.ok()) return memory.status();
  memory_ = *std::move(memory);
  report(v1::TRAIN_STAGE_QUEUED, 0);
  return backend_.trainings.submit([this] { run(); }, {.stop = stop_.get_token(), .deadline = deadline_});
}

void TrainCall::OnCancel() {
  cancel_time_ = Clock::now();
  stop_.request_stop();
  backend_.trainings.run_stopped();
}

void TrainCall::OnWriteDone(bool /*ok*/) {
  backend_.writes.end(context_);
  advance([this] { writing_ = false; });
}

void TrainCall::run() {
  const LogTrace log_trace(trace_id_);
  const Clock::time_point start = Clock::now();
  const absl::StatusOr<v1::Model> outcome = contain_exceptions([this] { return train_and_save(); });
  if (outcome.ok()) {
    backend_.metrics.observe_training(seconds_since(start));
    spdlog::info("trained {} generation {} in {:.2f} s", outcome->id(), outcome->generation(), seconds_since(arrival_));
  } else {
    log_failure("training of " + request_.id(), outcome.status());
  }
  if (absl::IsCancelled(outcome.status())) backend_.metrics.observe_cancel("training", seconds_since(cancel_time_));
  end(outcome);
}

absl::StatusOr<v1::Model> TrainCall::train_and_save() {
  if (absl::Status status = check_model_id("id", request_.id()); !status.ok()) return status;
  const RunControl control = {.stop = stop_.get_token(), .deadline = deadline_};
  if (absl::Status status = control.status(); !status.ok()) return status;
  const absl::StatusOr<TrainParams> params = to_train_params(request_.params());
  if (!params.ok()) return params.status();
  report(v1::TRAIN_STAGE_READING_MESH, 0);
  const absl::StatusOr<Mesh> mesh = to_mesh(request_.mesh(), control);
  if (!mesh.ok()) return mesh.status();

  absl::StatusOr<Model> model = train(*mesh, *params, control, [this](TrainStage stage, double progress) {
    report(to_proto(stage), kComputeShare * progress);
  });
  if (!model.ok()) return model.status();
  if (absl::Status status = control.status(); !status.ok()) return status;
  auto doubt = doubt_unit(model->diameter, request_.mesh().unit());
  if (doubt) model->warnings.push_back(*std::move(doubt));
  report(v1::TRAIN_STAGE_SAVING, kComputeShare);
  const auto stored = backend_.models.put(request_.id(), *std::move(model));
  if (!stored.ok()) return stored.status();
  return to_proto(**stored);
}

void TrainCall::report(v1::TrainStage stage, double progress) {
  v1::TrainResponse response;
  response.set_stage(stage);
  response.set_progress(progress);
  advance([&] { pending_ = std::move(response); });
}

void TrainCall::end(const absl::StatusOr<v1::Model>& outcome) {
  backend_.metrics.count_request(Method::kTrain, outcome.status().code(), seconds_since(arrival_));
  advance([&] {
    if (outcome.ok()) {
      pending_.emplace();
      pending_->set_stage(v1::TRAIN_STAGE_DONE);
      pending_->set_progress(1);
      *pending_->mutable_model() = *outcome;
    }
    end_ = to_grpc(outcome.status());
  });
}

/// Makes a change and starts what it has made possible. The last action of whoever calls: once the lock is open,
/// another thread may end the call, and this is gone.
template <class Change>
void TrainCall::advance(Change change) {
  bool write = false;
  bool finish = false;
  {
    const std::lock_guard lock(mutex_);
    change();
    if (writing_ || finished_) return;
    if (pending_) {
      write = writing_ = true;
      outgoing_ = *std::move(pending_);
      pending_.reset();
    } else if (end_) {
      finish = finished_ = true;
    }
  }
  if (write) {
    backend_.writes.begin(context_);
    StartWrite(&outgoing_);
  }
  if (finish) Finish(*end_);
}

}  // namespace binpose::server

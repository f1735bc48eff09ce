#include "server/hang_guard.h"

#include <spdlog/spdlog.h>

#include <condition_variable>

#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace binpose::server {
namespace {

/// Calls `act` again and again until it shall stop.
template <class Act>
void repeat(std::chrono::milliseconds interval, const std::stop_token& stop, Act act) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  while (!wake.wait_for(lock, stop, interval, [&stop] { return stop.stop_requested(); })) act();
}

std::string time_of_day(double seconds_ago) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%S%Ez", absl::Now() - absl::Seconds(seconds_ago), absl::LocalTimeZone());
}

}  // namespace

HangGuard::HangGuard(std::filesystem::path directory, std::function<bool()> answers, const Times& times)
    : directory_(std::move(directory)),
      times_(times),
      asker_([this, answers = std::move(answers)](const std::stop_token& stop) { ask(answers, stop); }),
      teller_([this](const std::stop_token& stop) { tell(stop); }) {}

void HangGuard::note_answer() {
  const std::lock_guard lock(mutex_);
  fault_ = absl::OkStatus();
  last_answer_ = Clock::now();
}

void HangGuard::note_fault(const absl::Status& fault) {
  const std::lock_guard lock(mutex_);
  fault_ = fault;
}

absl::Status HangGuard::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

/// So that a slow disk that takes or gives a model is not taken for one that hangs.
void HangGuard::ask(const std::function<bool()>& answers, const std::stop_token& stop) {
  repeat(times_.patience / 10, stop, [&] {
    if (fault().ok() && answers()) last_answer_ = Clock::now();
  });
}

/// Never touches the directory. A directory that comes and goes is told away once in a while only.
void HangGuard::tell(const std::stop_token& stop) {
  bool is_told = false;
  Clock::time_point told;
  Clock::time_point since;  // it is away
  repeat(times_.patience / 10, stop, [&] {
    const absl::Status fault = this->fault();
    const bool is_away = !fault.ok() || is_silent();
    if (is_told && !is_away) {
      spdlog::info("the model directory {} answers again; it was away for {:.0f} s", directory_.string(),
                   seconds_since(since));
      is_told = false;
    } else if (is_away && !is_told && (told == Clock::time_point() || Clock::now() - told >= times_.rest)) {
      since = last_answer_;
      told = Clock::now();
      is_told = true;
      spdlog::warn(
          "The model directory {} is away since {}: {} What is in memory is served meanwhile, what needs the directory "
          "waits or fails. Look at its mount in /proc/mounts, at what `dmesg` says of its file server, "
          "and whether that can be reached.",
          directory_.string(), time_of_day(age()), fault.ok() ? "it does not answer." : std::string(fault.message()));
    }
  });
}

absl::Status HangGuard::check_answers() const {
  if (!is_silent()) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrFormat("The model directory %s has not answered for %.0f s.", directory_.string(), age()));
}

void HangGuard::abandon(std::future<void> call) {
  const std::lock_guard lock(mutex_);
  std::erase_if(abandoned_,
                [](const auto& other) { return other.wait_for(std::chrono::seconds(0)) == std::future_status::ready; });
  abandoned_.push_back(std::move(call));
}

}  // namespace binpose::server

#include "client/cli/load.h"

#include <algorithm>
#include <memory>
#include <thread>

#include "client/call_error.h"

namespace binpose::client::cli {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

/// One stream's share of the plan: scans `first`, `first + streams`, ...
class StreamLoad {
 public:
  StreamLoad(const LoadPlan& plan, std::uint64_t first, Clock::time_point start, Client& client)
      : plan_(plan), first_(first), start_(start), stream_(client.open_detect_stream()) {
    const auto all = static_cast<std::uint64_t>(plan.rate * plan.duration);
    count_ = first < all ? (all - first - 1) / static_cast<std::uint64_t>(plan.streams) + 1 : 0;
    report_.due = count_;
    writer_ = std::thread([this] { write_all(); });
    reader_ = std::thread([this] { read_all(); });
  }

  StreamLoad(const StreamLoad&) = delete;
  StreamLoad& operator=(const StreamLoad&) = delete;

  ~StreamLoad() {
    if (writer_.joinable()) writer_.join();
    if (reader_.joinable()) reader_.join();
  }

  LoadReport wait() {
    writer_.join();
    reader_.join();
    if (absl::Status status = stream_->finish(); !status.ok()) ++report_.errors[std::string(status.message())];
    return std::move(report_);
  }

 private:
  std::uint64_t index_of(std::uint64_t i) const { return first_ + i * static_cast<std::uint64_t>(plan_.streams); }

  Clock::time_point due(std::uint64_t i) const {
    const std::chrono::duration<double> after(static_cast<double>(index_of(i)) / plan_.rate);
    return start_ + std::chrono::duration_cast<Clock::duration>(after);
  }

  void write_all() {
    for (std::uint64_t i = 0; i < count_; ++i) {
      std::this_thread::sleep_until(due(i));
      const bool is_over = seconds_between(start_, Clock::now()) > plan_.duration;
      if (is_over || !stream_->write(plan_.requests[index_of(i) % plan_.requests.size()]).ok()) {
        report_.unsent = count_ - i;
        break;
      }
    }
    stream_->done_writing();
  }

  void read_all() {
    for (std::uint64_t i = 0; i < count_; ++i) {
      // No scan can be answered before it was sent, and a stream's patience is for answers.
      std::this_thread::sleep_until(due(i));
      const std::optional<v1::DetectResponse> answer = stream_->read();
      if (!answer.has_value()) return;
      report_.seconds = seconds_between(start_, Clock::now());
      const double latency = seconds_between(due(i), Clock::now());
      report_.latency.record(latency);
      if (absl::Status error = frame_error(*answer); !error.ok()) {
        ++report_.errors[std::string(error.message())];
        continue;
      }
      ++report_.answered;
      report_.queue.record(answer->stats().queue_seconds());
      report_.computation.record(answer->stats().total_seconds());
      report_.overhead.record(latency - answer->stats().total_seconds());
    }
  }

  const LoadPlan& plan_;
  const std::uint64_t first_;
  const Clock::time_point start_;
  std::uint64_t count_ = 0;
  LoadReport report_;  ///< the reader's until wait(), but for `unsent`, the writer's
  std::unique_ptr<DetectStream> stream_;
  std::thread writer_, reader_;
};

}  // namespace

LoadReport run_load(const LoadPlan& plan, Client& client) {
  const Clock::time_point start = Clock::now();
  std::vector<std::unique_ptr<StreamLoad>> loads;
  loads.reserve(static_cast<std::size_t>(plan.streams));
  for (int s = 0; s < plan.streams; ++s) {
    loads.push_back(std::make_unique<StreamLoad>(plan, static_cast<std::uint64_t>(s), start, client));
  }
  LoadReport sum;
  for (const std::unique_ptr<StreamLoad>& load : loads) {
    const LoadReport part = load->wait();
    sum.due += part.due;
    sum.unsent += part.unsent;
    sum.answered += part.answered;
    for (const auto& [sentence, count] : part.errors) sum.errors[sentence] += count;
    sum.seconds = std::max(sum.seconds, part.seconds);
    sum.latency.add(part.latency);
    sum.queue.add(part.queue);
    sum.computation.add(part.computation);
    sum.overhead.add(part.overhead);
  }
  return sum;
}

}  // namespace binpose::client::cli

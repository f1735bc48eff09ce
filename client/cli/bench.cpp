#include <iostream>
#include <memory>
#include <sstream>

#include "client/cli/command.h"
#include "client/cli/load.h"
#include "client/cli/scan_options.h"
#include "client/cli/style.h"
#include "client/cli/table.h"

namespace binpose::client::cli {
namespace {

struct BenchOptions {
  ScanOptions scan;
  LoadPlan plan;
};

double per_second(const LoadReport& report) {
  return report.seconds > 0 ? static_cast<double>(report.answered) / report.seconds : 0;
}

std::vector<std::string> row(const std::string& name, const Histogram& durations) {
  constexpr double kMilliseconds = 1000;
  return {name, fixed(kMilliseconds * durations.quantile(0.5), 1), fixed(kMilliseconds * durations.quantile(0.95), 1),
          fixed(kMilliseconds * durations.quantile(0.99), 1), fixed(kMilliseconds * durations.max(), 1)};
}

void print_report(const LoadReport& report, const LoadPlan& plan) {
  std::cout << report.answered << " of " << report.due << " scans answered in " << fixed(report.seconds, 1)
            << " s over " << plan.streams << (plan.streams == 1 ? " stream: " : " streams: ")
            << fixed(per_second(report), 1) << " a second, " << fixed(plan.rate, 1) << " due\n";
  Table table = {{"", "p50 ms", "p95 ms", "p99 ms", "max ms"}};
  table.push_back(row("due to answer", report.latency));
  table.push_back(row("server's queue", report.queue));
  table.push_back(row("server's computing", report.computation));
  table.push_back(row("all but computing", report.overhead));
  print(table, std::cout);
  if (report.unsent > 0) {
    std::cout << coloured(std::to_string(report.unsent) + " x ", Colour::kRed, stdout)
              << "never sent, because the server did not keep up\n";
  }
  for (const auto& [sentence, count] : report.errors) {
    std::cout << coloured(std::to_string(count) + " x ", Colour::kRed, stdout) << sentence << '\n';
  }
}

std::string json_of(const Histogram& durations) {
  std::ostringstream json;
  json << "{\"p50\":" << durations.quantile(0.5) << ",\"p95\":" << durations.quantile(0.95)
       << ",\"p99\":" << durations.quantile(0.99) << ",\"max\":" << durations.max() << "}";
  return json.str();
}

void print_json(const LoadReport& report) {
  std::uint64_t failed = 0;
  for (const auto& [sentence, count] : report.errors) failed += count;
  std::cout << "{\"due\":" << report.due << ",\"answered\":" << report.answered << ",\"unsent\":" << report.unsent
            << ",\"failed\":" << failed << ",\"seconds\":" << report.seconds
            << ",\"answersPerSecond\":" << per_second(report) << ",\"latencySeconds\":" << json_of(report.latency)
            << ",\"queueSeconds\":" << json_of(report.queue) << ",\"totalSeconds\":" << json_of(report.computation)
            << ",\"overheadSeconds\":" << json_of(report.overhead) << "}" << std::endl;
}

ExitCode bench(BenchOptions& options, const GlobalOptions& global) {
  for (const std::string& scene : options.scan.scenes) {
    absl::StatusOr<v1::DetectRequest> request = make_request(options.scan, scene);
    if (!request.ok()) {
      report(request.status());
      return kUnreadable;
    }
    options.plan.requests.push_back(std::make_shared<const v1::DetectRequest>(*std::move(request)));
  }
  Client client = connect(global);
  // Before any load: does the server answer, and know the models?
  if (absl::Status status = client.detect(options.plan.requests.front()).status(); !status.ok()) {
    return report_call(status);
  }
  const LoadReport result = run_load(options.plan, client);
  if (global.json) {
    print_json(result);
  } else {
    print_report(result, options.plan);
  }
  return result.errors.empty() ? kOk : kRefused;
}

}  // namespace

void add_bench(CLI::App& app, const GlobalOptions& global, Command& chosen) {
  const auto options = std::make_shared<BenchOptions>();
  CLI::App& command = *app.add_subcommand("bench", "Put a load on a server and say how long answers take");
  command.footer(R"(
Scans become due at the rate, whether or not the server keeps up; "due to answer" counts the time they wait for it.

Examples:
  binpose bench --model gear --scene scan_1/ scan_2/ --unit mm --rate 10 --streams 2 --duration 30
  binpose bench --model gear --scene bin.ply --unit mm --rate 5 --json)");
  add_scan_options(command, options->scan);
  command.add_option("--rate", options->plan.rate, "Scans a second, over all streams")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 10000.0));
  command.add_option("--streams", options->plan.streams, "Streams to send them on")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  command.add_option("--duration", options->plan.duration, "Seconds in which scans become due")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 86400.0));
  command.callback([&chosen, options, &global] { chosen = [options, &global] { return bench(*options, global); }; });
}

}  // namespace binpose::client::cli

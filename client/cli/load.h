#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/cli/histogram.h"
#include "client/client.h"

namespace binpose::client::cli {

/// An open-loop load: scans become due at a fixed rate, whether or not the server keeps up.
struct LoadPlan {
  std::vector<Scan> requests;  ///< sent in turn, again and again
  double rate = 1;             ///< scans a second, over all streams
  int streams = 1;
  double duration = 10;  ///< seconds in which scans become due
};

/// What came of it.
struct LoadReport {
  std::uint64_t due = 0;       ///< scans that became due
  std::uint64_t unsent = 0;    ///< of these: not taken by the server before the plan's duration was over
  std::uint64_t answered = 0;  ///< without an error
  std::map<std::string, std::uint64_t> errors;  ///< by sentence
  double seconds = 0;                           ///< from the first scan due to the last answer
  Histogram latency;                            ///< from when a scan was due to its answer: a late start counts
  Histogram queue;                              ///< what the server says of its queue
  Histogram computation;                        ///< and of its computing
  Histogram overhead;  ///< from when a scan was due to its answer, less computing: wire, queue, decoding
};

/// Runs the plan; returns when every scan that was sent has its answer or its stream has ended.
LoadReport run_load(const LoadPlan& plan, Client& client);

}  // namespace binpose::client::cli

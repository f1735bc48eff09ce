#pragma once

#include "server/compute_pool.h"
#include "server/drain.h"
#include "server/memory_budget.h"
#include "server/metrics.h"
#include "server/model_store.h"
#include "server/tokens.h"
#include "server/write_watch.h"

namespace binpose::server {

/// What the services work with; outlives them.
struct Backend {
  ModelStore& models;
  ComputePool& detections;
  ComputePool& trainings;  ///< its own threads, so that trainings never fill those of detections
  MemoryBudget& requests;  ///< the bytes of all requests that wait or are computed
  const Tokens& tokens;
  Metrics& metrics;
  Drain& drain;
  WriteWatch& writes;
};

}  // namespace binpose::server

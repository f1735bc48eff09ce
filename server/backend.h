#pragma once

#include "server/compute_pool.h"
#include "server/drain.h"
#include "server/metrics.h"
#include "server/model_store.h"

namespace binpose::server {

/// What the services work with; outlives them.
struct Backend {
  ModelStore& models;
  ComputePool& detections;
  ComputePool& trainings;  ///< its own threads, so that trainings never fill those of detections
  Metrics& metrics;
  Drain& drain;
};

}  // namespace binpose::server

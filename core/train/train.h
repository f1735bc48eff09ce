#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "core/geometry/mesh.h"
#include "core/model.h"
#include "core/run_control.h"

namespace binpose {

enum class TrainStage { kSampling, kVisibility, kVectorPairs, kSymmetry };

/// Told when a stage starts or gets on; `progress` in [0, 1] of the whole training, never falling. Called on the
/// thread that called train().
using TrainObserver = std::function<void(TrainStage stage, double progress)>;

/// Compiles a mesh into a model [paper, sections II and III].
///
/// The winding of closed bodies does not matter, nor whether their triangles agree: each is turned to the side that is
/// seen. A surface without a back is taken from the side that its winding shows; its back is not found. What matters to
/// detection of what is wrong with a mesh stands in the model's `warnings`.
///
/// Deterministic: equal mesh and parameters give an equal model on any number of threads.
/// Errors: INVALID_ARGUMENT (parameters; a mesh that is empty, not finite, without area or of absurd extent),
/// CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<Model> train(const Mesh& mesh, const TrainParams& params, const RunControl& control,
                            const TrainObserver& observer = {});

}  // namespace binpose

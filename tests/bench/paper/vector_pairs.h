#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/model.h"
#include "core/params.h"
#include "tests/bench/paper/method.h"

namespace binpose::paper {

/// The paper's three ways to pick vector pairs, by name, in the order of Table I.
const std::vector<std::pair<std::string, PairSelection>>& selections();

/// The paper's preset for detection, with or without the ICP that every method of the table ends with.
DetectParams paper_detection(bool refine);

/// core's training; throws std::runtime_error where it fails.
Model train_model(const testing::ScenePart& part, const TrainParams& params);

/// core's detection, one thread.
Finder finder(Model model, const DetectParams& params);

}  // namespace binpose::paper

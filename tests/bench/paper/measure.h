#pragma once

#include "tests/bench/paper/method.h"
#include "tests/bench/paper/run_log.h"
#include "tests/support/scene_score.h"

namespace binpose::paper {

/// One method on one scene: "best_right" (0 or 1), "instances" (of visibility >= 0.5), "hits" (of these), "wrong"
/// poses, "seconds" of the processor (on an idle machine those of the clock, as all methods run on one thread).
Json measure(const Finder& find, const testing::BinScene& scene, const testing::PoseJudge& judge);

}  // namespace binpose::paper

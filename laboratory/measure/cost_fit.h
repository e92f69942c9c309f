// Fits the constants of the cost model to measured times: linear least squares of relative residuals, since the noise of a time grows with
// the time, with no constant below 0 (active set method of Lawson and Hanson, "Solving Least Squares Problems", 1974, chapter 23).
#pragma once

#include <span>
#include <vector>

#include "common/base/status.h"
#include "laboratory/measure/cost_model.h"

namespace slabstream {

// One rendered box: its amounts of work, and the time of each stage.
struct CostSample {
  WorkUnits work{};
  StageTimes stage_ns{};
};

struct TermFit {
  WorkUnit unit = WorkUnit::kBox;
  double seconds = 0;        // a unit
  double low = 0, high = 0;  // 95 % confidence interval, cut at 0
};

struct StageFit {
  std::vector<TermFit> terms;  // by the order of the stage's units
  double residual = 0;         // root mean square of (measured - fitted) / measured
  double prediction_error =
      0;  // mean |measured - predicted| / mean measured: each fifth of the samples as the fit to the others predicts it
};

// InvalidArgument: fewer than three samples a unit in which the stage took time; the others do not count.
Result<StageFit> FitStage(const StageModel& stage, std::span<const CostSample> samples);

}  // namespace slabstream

// Fits the constants of a CostModel to measured times: linear least squares of relative residuals, since the noise of a time grows with the
// time, with no constant below 0 (active set method of Lawson and Hanson, "Solving Least Squares Problems", 1974, chapter 23).
#pragma once

#include <cstddef>
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

struct PredictedSample {
  std::size_t index = 0;  // in the given samples
  double measured = 0;    // seconds
  double predicted = 0;   // by the fit to the other four fifths of the samples; each fifth is predicted together
};

struct StageFit {
  StageCost cost;                        // with the fitted constants
  std::vector<TermFit> terms;            // by the order of cost.units
  std::vector<PredictedSample> samples;  // those in which the stage took any time
  double residual = 0;                   // root mean square of (measured - fitted) / measured
  double prediction_error = 0;           // mean |measured - predicted| / mean measured
};

// `stage` lists the units that count; its constants are replaced. InvalidArgument: fewer than three samples a unit in which the stage took
// time.
Result<StageFit> FitStage(const StageCost& stage, std::span<const CostSample> samples);

struct CostFit {
  std::vector<StageFit> stages;
  double prediction_error = 0;  // of all stages together
};

// All stages of a pipeline, fitted to samples of that pipeline.
Result<CostFit> FitCosts(std::span<const StageCost> stages, std::span<const CostSample> samples);

}  // namespace slabstream

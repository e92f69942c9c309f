// Our own model of the stages (laboratory/measure/cost_model.h), fitted to every slab of every N and p; the cost of combining a pixel, and
// a clock cycle.

#include <cmath>

#include "common/parallel/task_arena.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/calibrate.h"
#include "laboratory/measure/cost_fit.h"
#include "laboratory/measure/thread_time.h"

namespace slabstream {
namespace {

std::vector<CostSample> SlabsOf(const PaperSetup& setup, const RendererKind* renderer) {
  std::vector<CostSample> samples;
  for (const int size : setup.sizes()) {
    for (const int p : setup.workers()) {
      for (const MeasuredFrame::Cost& box : Recall(setup.context(), setup.Frame(renderer, size, p)).boxes) {
        if (box.seconds <= 0) continue;
        CostSample& sample = samples.emplace_back(CostSample{.work = box.work, .stage_ns = {}});
        for (std::size_t stage = 0; stage < sample.stage_ns.size(); ++stage)
          sample.stage_ns[stage] = std::llround(box.stage_seconds[stage] * 1e9);
      }
    }
  }
  return samples;
}

// To find a pixel of a partial image, copy it into a message and combine it with another one.
Trial CombiningTrial(const RendererKind* renderer) {
  const auto run = [renderer]() -> Json {
    TaskArena one_thread(1);
    const CombiningCosts costs = one_thread.Run([renderer] { return MeasureCombining(ImageTransfer::kMessage, renderer->format()); });
    return {{"seconds", costs.scan_pixel + costs.encode_pixel + costs.combine_pixel}};
  };
  return {{{"what", "combining pixel"}, {"renderer", renderer->name()}}, run, 5};
}

// A clock cycle: additions of whole numbers, each of the last sum to itself, take one cycle each on today's processors.
double CycleSeconds() {
  constexpr int kRuns = 7, kAdditions = 1 << 20;
  return MedianSecondsOf(kRuns,
                         [] {
                           std::uint64_t sum = 1;
                           for (int i = 0; i < kAdditions; ++i) {
                             asm volatile("" : "+r"(sum));  // keeps additions apart
                             sum += sum;
                           }
                           asm volatile("" : : "r"(sum));
                         }) /
         kAdditions;
}

Trial CycleTrial() {
  return {{{"what", "clock cycle"}}, []() -> Json { return {{"seconds", CycleSeconds()}}; }, 0.1};
}

}  // namespace

std::vector<Trial> ConstantsTrials(const PaperSetup&) { return {CombiningTrial(Splatting()), CombiningTrial(ZBuffer()), CycleTrial()}; }

void AddConstants(const PaperSetup& setup, Results& results) {
  const auto seconds = [&](const Trial& trial) { return ValuesOf(setup.context().log(), trial.key, "seconds"); };
  results.Add({{"part", "clock-cycle"}}, "constant", seconds(CycleTrial()), Origin::kMeasured);
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    results.Add({{"part", "combining-pixel"}, {"renderer", renderer->name()}, {"stage", "combine"}}, "constant",
                seconds(CombiningTrial(renderer)), Origin::kMeasured);
    const std::vector<CostSample> slabs = SlabsOf(setup, renderer);
    for (const StageModel& stage : CostModelOf(renderer->name())) {
      const Result<StageFit> fit = FitStage(stage, slabs);
      if (!fit.ok()) continue;  // the stage never took any time, as in very small runs
      Json of = {{"part", "fit"}, {"renderer", renderer->name()}, {"stage", ToString(stage.stage)}};
      const auto add = [&](std::string_view variant, std::string_view metric, const Estimate& value) {
        of["variant"] = variant;
        results.Add(of, metric, value, Origin::kMeasured);
      };
      const int repeats = setup.context().repeats();
      for (const TermFit& term : fit->terms) add(ToString(term.unit), "constant", {term.seconds, term.low, term.high, 0.95, repeats});
      add("residual, root mean square", "error", {fit->residual, fit->residual, fit->residual, 1, repeats});
      add("slabs that the fit has not seen, mean", "error",
          {fit->prediction_error, fit->prediction_error, fit->prediction_error, 1, repeats});
    }
  }
}

}  // namespace slabstream

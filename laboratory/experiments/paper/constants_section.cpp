// Our own model of the stages (laboratory/measure/cost_model.h), fitted to every slab of every N and p, and the cost of combining a pixel.
#include <cmath>

#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/measure/cost_fit.h"

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

}  // namespace

void AddConstants(const PaperSetup& setup, Results& results) {
  std::vector<double> pixels;  // of a colour image, written, read and composited by our operators
  for (const MachineModel& machine : Clusters(setup.context(), Link("10gbit"))) {
    pixels.push_back(machine.combining.scan_pixel + machine.combining.encode_pixel + machine.combining.combine_pixel);
  }
  results.Add({{"part", "combining-pixel"}, {"renderer", Splatting()->name()}, {"stage", "combine"}}, "constant",
              MedianOf(std::move(pixels)), Origin::kMeasured);
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
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

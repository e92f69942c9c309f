// Frames of the service beside their simulation, for as many workers as this machine has cores.
#include "laboratory/experiments/paper/setup.h"

namespace slabstream {
namespace {

constexpr int kTurns = 7;

std::vector<FrameCase> Frames(const PaperSetup& setup) {
  std::vector<FrameCase> frames;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const int size : setup.sizes()) {
      for (const int p : setup.MeasuredWorkers()) frames.push_back(setup.Frame(renderer, size, p));
    }
  }
  return frames;
}

}  // namespace

std::vector<Trial> ValidationTrials(const PaperSetup& setup) {
  std::vector<Trial> trials;
  for (const FrameCase& frame : Frames(setup)) trials.push_back(ValidationTrial(setup.context(), frame, kTurns));
  return trials;
}

void AddValidation(const PaperSetup& setup, Results& results) {
  for (const FrameCase& frame : Frames(setup)) {
    const Json of = ColumnsOf(frame, {{"part", "validation"}, {"link", "host"}});
    const Json key = ValidationKey(setup.context(), frame, kTurns);
    const auto add = [&](const char* number, Origin origin) {
      results.Add(of, "latency", ValuesOf(setup.context().log(), key, number, 1e-3), origin);
    };
    add("measured_ms", Origin::kMeasured);
    add("simulated_ms", Origin::kSimulated);
  }
}

}  // namespace slabstream

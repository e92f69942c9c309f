// The frames of tables 2, 5 and 6 and figures 9, 10 and 11 at a running service: real processes, with as many workers as it has.
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/service_frames.h"

namespace slabstream {
namespace {

std::vector<FrameCase> Frames(const PaperSetup& setup, int workers) {
  std::vector<FrameCase> frames;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const int size : setup.sizes()) frames.push_back(setup.Frame(renderer, size, workers));
    if (workers == 1) continue;
    frames.push_back(setup.Frame(renderer, setup.table_size(), workers));
    frames.back().policy.combine = "centralized";
    frames.push_back(setup.Frame(renderer, setup.table_size(), workers));
    frames.back().policy.axis = AxisChoice::kAuto;
  }
  return frames;
}

}  // namespace

void RunPaperAtService(const PaperSetup& setup, Results& results) {
  MeasureAtService(setup.context(), results, [&](int workers) {
    std::vector<ServedFrame> served;
    for (const FrameCase& frame : Frames(setup, workers)) served.push_back({frame, ColumnsOf(frame, {{"part", "service frames"}})});
    return served;
  });
}

}  // namespace slabstream

#include "laboratory/experiments/paper/measures.h"

#include <algorithm>
#include <array>

namespace slabstream {
namespace {

constexpr std::array<Stage, 5> kStages = {Stage::kTransform, Stage::kShade, Stage::kSplat, Stage::kComposite, Stage::kZBuffer};

}  // namespace

PaperFrame CountAsPaper(const PaperSetup& setup, const FrameCase& frame, const MachineModel& machine, Images images) {
  MeasuredFrame measured = Recall(setup.context(), frame);
  measured.finish_seconds = measured.receive_seconds = 0;
  if (images == Images::kWhole) FillImages(measured);
  PaperFrame counted;
  for (const MeasuredFrame::Cost& box : measured.boxes) {  // one for each worker
    if (box.seconds <= counted.render_seconds) continue;
    counted.render_seconds = box.seconds;
    counted.stage_seconds = {};
    double sum = 0;
    for (const Stage stage : kStages) sum += box.stage_seconds[std::size_t(stage)];
    // The time between the stages is shared out among them.
    for (const Stage stage : kStages) {
      counted.stage_seconds[std::size_t(stage)] = sum > 0 ? box.stage_seconds[std::size_t(stage)] * box.seconds / sum : 0;
    }
  }
  if (frame.workers == 1) {
    counted.seconds = counted.render_seconds;
    return counted;
  }
  const Timeline timeline = Simulate(measured, machine);
  counted.seconds = std::max(timeline.frames.front().latency(), counted.render_seconds);
  counted.origin = Origin::kSimulated;
  counted.combine_seconds = counted.seconds - counted.render_seconds;
  return counted;
}

}  // namespace slabstream

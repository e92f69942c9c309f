#include "laboratory/experiments/figures.h"

#include <algorithm>

#include "laboratory/experiments/balanced_case.h"

namespace slabstream {

FrameFigures FindFigures(const MeasuredFrame& frame, const MachineModel& machine, int teams) {
  const Timeline alone = Simulate(frame, machine);
  const SimulatedFrame& first = alone.frames.front();
  return {.latency_seconds = first.latency(),
          .preview_seconds = first.groups_done.empty() ? first.latency() : first.groups_done.front() - first.submitted,
          .steady_seconds = SteadySeconds(frame, machine, teams),
          .imbalance = first.imbalance,
          .idle_share = first.idle_share,
          .image_bytes = first.image_bytes};
}

FrameFigures RecallFigures(ExperimentContext& context, const FrameCase& frame, const MachineModel& machine, double FrameFigures::*by,
                           int teams) {
  if (!IsDynamic(frame)) return FindFigures(Recall(context, frame), machine, teams);
  std::vector<FrameFigures> repeats;
  for (const MeasuredFrame& repeat : RecallBalanced(context, frame)) repeats.push_back(FindFigures(repeat, machine, teams));
  std::ranges::sort(repeats, {}, by);
  return repeats[repeats.size() / 2];
}

}  // namespace slabstream

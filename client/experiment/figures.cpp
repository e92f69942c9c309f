#include "client/experiment/figures.h"

#include "client/experiment/policies.h"

namespace slabstream {

Result<FrameFigures> FindFigures(const MeasuredFrame& frame, const MachineModel& machine) {
  const Result<Timeline> alone = Simulate(frame, machine);
  if (!alone.ok()) return alone.status();
  const Result<Timeline> flowing = Simulate(frame, machine, kSteadyFrames, kFramesAhead);
  if (!flowing.ok()) return flowing.status();
  const SimulatedFrame& first = alone->frames.front();
  FrameFigures figures;
  figures.latency_seconds = first.latency();
  figures.preview_seconds = first.groups_done.empty() ? first.latency() : first.groups_done.front() - first.submitted;
  figures.steady_seconds = SteadySeconds(*flowing);
  figures.imbalance = first.imbalance;
  figures.idle_share = first.idle_share;
  figures.image_bytes = first.image_bytes;
  return figures;
}

}  // namespace slabstream

#include "laboratory/experiments/figures.h"

namespace slabstream {

Result<FrameFigures> FindFigures(const MeasuredFrame& frame, const MachineModel& machine, int teams) {
  const Result<Timeline> alone = Simulate(frame, machine);
  if (!alone.ok()) return alone.status();
  const Result<double> steady = SteadySeconds(frame, machine, teams);
  if (!steady.ok()) return steady.status();
  const SimulatedFrame& first = alone->frames.front();
  FrameFigures figures;
  figures.latency_seconds = first.latency();
  figures.preview_seconds = first.groups_done.empty() ? first.latency() : first.groups_done.front() - first.submitted;
  figures.steady_seconds = *steady;
  figures.imbalance = first.imbalance;
  figures.idle_share = first.idle_share;
  figures.image_bytes = first.image_bytes;
  return figures;
}

}  // namespace slabstream

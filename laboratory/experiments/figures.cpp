#include "laboratory/experiments/figures.h"

#include <algorithm>

#include "laboratory/experiments/balanced_case.h"

namespace slabstream {
namespace {

FrameFigures FiguresOf(const MeasuredFrame& frame, const MachineModel& machine, int teams) {
  const Timeline alone = Simulate(frame, machine);
  const SimulatedFrame& first = alone.frames.front();
  return {.latency_seconds = first.latency(),
          .preview_seconds = first.groups_done.empty() ? first.latency() : first.groups_done.front() - first.submitted,
          .steady_seconds = SteadySeconds(frame, machine, teams),
          .imbalance = first.imbalance,
          .idle_share = first.idle_share,
          .image_bytes = first.image_bytes};
}

}  // namespace

std::vector<FrameFigures> FindFigures(const std::vector<MeasuredFrame>& frames, const std::vector<MachineModel>& machines, int teams) {
  std::vector<FrameFigures> repeats;
  for (std::size_t i = 0; i < std::min(frames.size(), machines.size()); ++i) repeats.push_back(FiguresOf(frames[i], machines[i], teams));
  return repeats;
}

std::vector<FrameFigures> RecallFigures(ExperimentContext& context, const FrameCase& frame, const LinkModel& link, int teams,
                                        const HostModel& host) {
  return FindFigures(RecallCosts(context, frame), Clusters(context, link, host), teams);
}

void AddFigures(Results& results, const Json& of, const std::vector<FrameFigures>& repeats) {
  struct Field {
    const char* metric;
    double FrameFigures::*figure;
  };
  constexpr Field kFields[] = {{"latency", &FrameFigures::latency_seconds}, {"preview", &FrameFigures::preview_seconds},
                               {"period", &FrameFigures::steady_seconds},   {"imbalance", &FrameFigures::imbalance},
                               {"idle_share", &FrameFigures::idle_share},   {"image_bytes", &FrameFigures::image_bytes}};
  for (const Field& field : kFields) results.Add(of, field.metric, EachOf(repeats, field.figure), Origin::kSimulated);
}

}  // namespace slabstream

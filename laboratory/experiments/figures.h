// FrameFigures: the figures by which ways to render are compared, from one simulated run.
#pragma once

#include <vector>

#include "laboratory/experiments/frame_case.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/results/results.h"

namespace slabstream {

struct FrameFigures {
  double latency_seconds = 0;  // for a frame that was not requested ahead
  double preview_seconds = 0;  // until its first group can be seen
  double steady_seconds = 0;   // from picture to picture, with frames requested ahead
  double imbalance = 1;        // most / mean render time of a worker
  double idle_share = 0;       // share of the workers' time of that frame
  double image_bytes = 0;      // between workers
};

// Of every repeat: repeat i of the frame on repeat i of the machine, as far as both go. `teams` of the size of the frame's take frames in
// turn.
std::vector<FrameFigures> FindFigures(const std::vector<MeasuredFrame>& frames, const std::vector<MachineModel>& machines, int teams = 1);

// The same of a frame whose CostTrial and FinishTrial were run, on machines joined by `link` (Clusters).
std::vector<FrameFigures> RecallFigures(ExperimentContext& context, const FrameCase& frame, const LinkModel& link, int teams = 1,
                                        const HostModel& host = {});

// Adds each figure as a metric: latency, preview, period, imbalance, idle_share, image_bytes.
void AddFigures(Results& results, const Json& of, const std::vector<FrameFigures>& repeats);

}  // namespace slabstream

// FrameFigures: what people compare of a way to render, of one simulated run.
#pragma once

#include "laboratory/experiments/frame_case.h"

namespace slabstream {

struct FrameFigures {
  double latency_seconds = 0;  // of a frame that nobody asked for ahead
  double preview_seconds = 0;  // until the first group of it can be seen
  double steady_seconds = 0;   // from picture to picture, with frames asked for ahead
  double imbalance = 1;        // most / mean render time of a worker
  double idle_share = 0;       // of the workers' time of that frame
  double image_bytes = 0;      // between workers
};

// `teams`: as large as the frame's, which take frames in turn.
Result<FrameFigures> FindFigures(const MeasuredFrame& frame, const MachineModel& machine, int teams = 1);

}  // namespace slabstream

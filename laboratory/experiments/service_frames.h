// Frames of a running service, measured as its client sees them.
#pragma once

#include <functional>
#include <vector>

#include "laboratory/experiments/frame_case.h"
#include "laboratory/results/results.h"

namespace slabstream {

struct ServedFrame {
  FrameCase frame;
  Json columns;  // of its results
};

// Measures frames at the service that the user named, each over and over: with one in flight, and with as many as keep all workers busy.
// Nothing is rendered here and nothing is simulated. `frames`: of as many workers as the service has. Adds measured latency, period,
// render_time, longest_render_time, picture_time, imbalance, idle_share and image_bytes of each, and the stage_time of the worker that
// renders longest; attaches the roster. Throws Failure, also if the roster changes meanwhile.
void MeasureAtService(ExperimentContext& context, Results& results, const std::function<std::vector<ServedFrame>(int workers)>& frames);

}  // namespace slabstream

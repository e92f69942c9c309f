// A sweep at a running service: its frames are measured as a client sees them. Nothing is rendered here and nothing is simulated.
#pragma once

#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/sweep_file.h"

namespace slabstream {

// Adds measured latency, period, render_time, longest_render_time, imbalance, idle_share and image_bytes of each frame, and attaches the
// roster: its workers with host and threads. Throws Failure, also if the roster changes meanwhile.
void RunServiceSweep(ExperimentContext& context, const Sweep& sweep, Results& results);

}  // namespace slabstream

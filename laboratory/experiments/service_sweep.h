// A sweep at a running service: its frames are measured as a client sees them. Nothing is rendered here and nothing is simulated.
#pragma once

#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/sweep_file.h"

namespace slabstream {

// Adds the figures of each frame (AddServiceFrames), and attaches the roster. Throws Failure.
void RunServiceSweep(ExperimentContext& context, const Sweep& sweep, Results& results);

}  // namespace slabstream

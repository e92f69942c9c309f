// Frames of a running service, measured as its client sees them.
#pragma once

#include "client/client.h"
#include "laboratory/experiments/frame_case.h"
#include "laboratory/results/results.h"

namespace slabstream {

// One frame over and over: with one in flight, and with as many as keep all workers busy. `begin`: the service when the run began. Throws
// Failure, also if the roster changes meanwhile.
Trial ServiceFramesTrial(Client& client, const StatusReply& begin, const FrameCase& frame);

// Adds measured latency, period, render_time, longest_render_time, picture_time, imbalance, idle_share and image_bytes, and the stage_time
// of the worker that renders longest. The trial must have been run.
void AddServiceFrames(Results& results, const Json& of, const TrialLog& log, const Trial& trial);

}  // namespace slabstream

// Frames of a service, measured by its client.
#pragma once

#include <span>
#include "client/client.h"
#include "laboratory/experiments/trial_log.h"

namespace slabstream {

// Frames that are rendered before any is measured: voxels travel and normals are made; with dynamic balance boxes find their sizes.
int WarmUpFrames(const Policy& policy);

// One frame in flight. Medians over `frames` frames after `warm_up` others: "latency_ms", "stages_ms" by name, "render_ms" (the sum over
// boxes), "longest_render_ms" (of the worker that renders longest), "longest_stages_ms" (of this worker), "picture_ms" (to make and encode
// the picture), "imbalance", "idle_share", "image_bytes"; and "all_latency_ms". Throws Failure with the frame's.
Json MeasureLatency(Client& client, const FrameRequest& request, int warm_up, int frames);

// Milliseconds from picture to picture, with `in_flight` frames requested ahead: over frames in the middle, when the pipeline is full and
// the last frames do not yet leave workers idle. The requests come in their order, over and over if there are too few. Throws Failure with
// a frame's.
double MeasurePeriod(Client& client, std::span<const FrameRequest> requests, int in_flight);

}  // namespace slabstream

// Reports of a command's frames as JSON.
#pragma once

#include <string>
#include <vector>

#include "client/cli/frame_loop.h"
#include "client/cli/options.h"

namespace slabstream {

// --stats: the plans and costs of the frames.
//
//   { "source", "renderer", "size": [w, h],
//     "plan": {"workers", "groups", "decomposition", "balance_by", "axis",       of the last frame: a lost worker changes it
//              "assignment", "balance", "combine"},
//     "bytes": {"voxels", "images"},                                        of all frames
//     "frames": [{"output", "latency_ms", "queued_ms",
//                 "direct": whether the picture came straight from a worker, not through the coordinator,
//                 "attempts", "workers", "bytes": {...}, "stages_ms": {stage: worker time}, "imbalance", "idle_share"}] }
std::string StatsJson(const FrameOptions& options, const std::vector<FrameRecord>& frames);

// --trace: the spans of all frames in Chrome's trace format
// (https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU), which Perfetto opens.
//
// One process a worker, with the tracks render, combine and fetch; names are stages, args give frame, group, rank and box. Process 0 has a
// track of whole frames for each frame in flight. Times are microseconds since the first frame was planned; those of workers are
// StageSpans.
std::string TraceJson(const std::vector<FrameRecord>& frames);

}  // namespace slabstream

// --stats: the plans and costs of the frames.
//
//   { "source", "renderer", "size": [w, h],
//     "plan": {"workers", "groups", "decomposition", "balance_by", "axis",       of the last frame: a lost worker changes it
//              "assignment", "balance", "combine"},
//     "bytes": {"voxels", "images"},                                        of all frames
//     "frames": [{"output", "latency_ms", "queued_ms",
//                 "direct": whether the picture came straight from a worker, not through the coordinator,
//                 "attempts", "workers", "bytes": {...}, "stages_ms": {stage: worker time}, "imbalance", "idle_share"}] }
#pragma once

#include <string>
#include <vector>

#include "client/cli/frame_loop.h"
#include "client/cli/options.h"

namespace slabstream {

std::string StatsJson(const FrameOptions& options, const std::vector<FrameRecord>& frames);

}  // namespace slabstream

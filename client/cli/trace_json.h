// --trace: the spans of all frames in Chrome's trace format
// (https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU), which Perfetto opens.
//
// One process a worker, with the tracks render, combine and fetch; names are stages, args give frame, group, rank and box. Process 0 has a
// track of whole frames for each frame in flight. Times are microseconds since the first frame was planned; those of workers are
// StageSpans.
#pragma once

#include <string>
#include <vector>

#include "client/cli/frame_loop.h"

namespace slabstream {

std::string TraceJson(const std::vector<FrameRecord>& frames);

}  // namespace slabstream

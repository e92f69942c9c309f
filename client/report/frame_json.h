// What JSON says of a frame's levels and bytes: in --stats, over HTTP and beside the viewer's pictures.
#pragma once

#include "client/report/frame_summary.h"
#include "common/json/json.h"

namespace slabstream {

// [{"level": 2, "boxes": 8, "voxels": 2097152}], finest first.
Json LevelsJson(const FrameStatistics& statistics);
// {"voxels", "stored", "images"}, as of FrameSummary.
Json BytesJson(const FrameSummary& summary);

}  // namespace slabstream

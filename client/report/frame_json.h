// What JSON says of a frame's levels and bytes: in --stats, over HTTP and beside the viewer's pictures.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "client/report/frame_summary.h"

namespace slabstream {

// [{"level": 2, "boxes": 8, "voxels": 2097152}], finest first.
nlohmann::ordered_json LevelsJson(const FrameStatistics& statistics);
// {"voxels", "stored", "images"}, as of FrameSummary.
nlohmann::ordered_json BytesJson(const FrameSummary& summary);

}  // namespace slabstream

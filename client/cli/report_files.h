// The files beside the pictures (--stats, --trace), for `render` and `turntable`.
#pragma once

#include <vector>

#include "client/cli/frame_loop.h"

namespace slabstream {

// Before work begins: checks that the directories exist.
Status CheckReportPaths(const FrameOptions& options);
inline bool WantsReports(const FrameOptions& options) { return !options.stats_path.empty() || !options.trace_path.empty(); }

// Afterwards: writes the requested files.
Status WriteReports(const FrameOptions& options, const std::vector<FrameRecord>& frames);

}  // namespace slabstream

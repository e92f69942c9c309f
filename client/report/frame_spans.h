// What the workers did for a frame, and when, on the coordinator's clock.
#pragma once

#include <cstdint>
#include <vector>

#include "common/stats/report.h"
#include "common/wire/client_messages.h"

namespace slabstream {

struct StageSpan {
  std::uint32_t worker = 0, group = 0, rank = 0, box = 0;
  Stage stage = Stage::kRender;
  std::int64_t begin_ns = 0, end_ns = 0;  // on the clock of FrameStatistics::begin_ns
};

// The spans of all reports, in their order. A worker measures by the clock of its host. If the coordinator's host is another one, their
// clocks differ by an unknown amount: then all spans of the worker are moved, so that its first work begins as the frame does. Their
// lengths and distances stay. The fetch of voxels for two frames may begin before the second one.
std::vector<StageSpan> StageSpans(const FrameStatistics& statistics);

}  // namespace slabstream

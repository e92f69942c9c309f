// The figures of one frame that people compare, computed from its reports, and what JSON says of them: in --stats, over HTTP and beside the
// viewer's pictures. Pure.
#pragma once

#include "common/json/json.h"
#include "common/stats/report.h"
#include "common/wire/client_messages.h"

namespace slabstream {

struct FrameSummary {
  StageTimes stage_ns{};           // worker time, summed over ranks
  std::int64_t render_ns = 0;      // the longest render time of a worker
  std::int64_t combine_ns = 0;     // combining and encoding of partial images, summed over workers
  std::int64_t finish_ns = 0;      // making and encoding the picture, of all its shares
  std::uint64_t voxel_bytes = 0;   // bytes of voxels that workers received or read
  std::uint64_t image_bytes = 0;   // bytes of images that travelled between workers
  std::uint64_t stored_bytes = 0;  // read from the dataset's source, as they are stored
  std::uint64_t sent_bytes = 0;    // from the coordinator to workers, as they travel; 0: workers read all voxels themselves
  double imbalance = 1;            // most / mean render time of a worker, over all workers of the plan; at least 1
  double idle_share = 0;  // share of the workers' time, from plan to last byte, in which none of a worker's threads had work; in [0, 1]
};

FrameSummary Summarize(const FrameStatistics& statistics);

constexpr double Milliseconds(std::int64_t ns) { return double(ns) / 1e6; }

// [{"level": 2, "boxes": 8, "voxels": 2097152}], finest first.
Json LevelsJson(const FrameStatistics& statistics);
// {"voxels", "stored", "sent", "images"}
Json BytesJson(const FrameSummary& summary);
// {"render": milliseconds, ...}, of all stages.
Json StagesJson(const FrameSummary& summary);

}  // namespace slabstream

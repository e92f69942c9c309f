// Recording: what a trace file stores of frames beside their spans, so that they can be simulated again: who rendered each box, in what
// time, and how much of the frame its image filled. `--trace` writes it under a key of its own, which trace viewers ignore.
//
//   "slabstream": {"version": 1, "frames": [
//     {"renderer": "splat", "grid": [w, h], "workers", "display", "combine",
//      "arrived_us", "begin_us", "end_us",    at the coordinator, since the first frame's arrival: arrival, plan, last byte
//      "latency_us", "picture_us",            for the client; making and encoding the picture
//      "image_bytes", "voxel_bytes",
//      "groups": [[{"box", "worker", "render_us", "bounds": [x_begin, y_begin, x_end, y_end], "pixels"}]]}]}    by rank, nearest first
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/base/time.h"
#include "common/json/json.h"
#include "common/planning/frame_plan.h"
#include "common/renderers/registry.h"
#include "common/wire/client_messages.h"

namespace slabstream {

inline constexpr char kRecordingKey[] = "slabstream";

struct RecordedRank {
  BoxId box = 0;
  WorkerId worker = 0;  // 0: no report for this rank
  double render_seconds = 0;
  PixelBounds bounds;  // pixels of its image, in the grid
  double pixels = 0;   // non-empty pixels in the bounds
};

struct RecordedFrame {
  const RendererKind* renderer = &DefaultRenderer();
  PixelBounds grid;  // pixels of the frame that was rendered and combined
  std::uint32_t workers = 1;
  WorkerId display = 0;
  std::string combine;
  double arrived = 0, begin = 0, end = 0;  // seconds, on the coordinator's own clock
  double latency = 0;                      // seconds, for the client
  double picture_seconds = 0;
  double image_bytes = 0, voxel_bytes = 0;  // that travelled
  std::vector<std::vector<RecordedRank>> groups;
};

// The statistics must contain the reports. Ranks without a report draw nothing and cost nothing.
RecordedFrame Record(const FrameStatistics& statistics, Duration latency);

Json RecordingJson(std::span<const RecordedFrame> frames);

// Parses the text of a whole trace file; at least one frame. InvalidArgument, naming the place: not JSON, not recorded by Slabstream,
// another version, or a missing or out-of-range value.
Result<std::vector<RecordedFrame>> ParseRecording(std::string_view text);

}  // namespace slabstream

// Frames, one after another, with some asked for ahead: what `render` (one frame), `turntable` and `bench` share.
#pragma once

#include <string>
#include <vector>

#include "client/cli/options.h"
#include "client/client.h"
#include "common/base/status.h"

namespace slabstream {

struct FrameJob {
  FrameRequest request;
  std::string output;  // where the picture goes; empty: nowhere
};

// What is remembered of a finished frame.
struct FrameRecord {
  std::string output;
  Duration latency{};          // request to last byte
  FrameStatistics statistics;  // reports only if they were asked for
};

struct FrameLoopOptions {
  int in_flight = 1;
  PictureFormat format;
  bool keep_reports = false;
  bool progress = false;  // on stderr
  std::string label;      // what the progress begins with
};

// Renders and writes `jobs`; pictures are encoded beside the frames that follow. The records are in the order of the jobs. The first
// failure cancels what is open and is returned; Ctrl-C does the same with Cancelled.
Result<std::vector<FrameRecord>> RenderFrames(Client& client, const std::vector<FrameJob>& jobs, const FrameLoopOptions& options);

}  // namespace slabstream

// Renders frames in sequence, with some requested ahead. Shared by `render` (one frame), `turntable` and `bench`.
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

// Figures of a finished frame.
struct FrameRecord {
  std::string output;
  Duration latency{};          // request to last byte
  FrameStatistics statistics;  // reports only if they were asked for
};

struct FrameLoopOptions {
  int in_flight = 1;
  PictureFormat format;
  std::string source;  // SOURCE as it was typed, for the records of pictures; empty: they get none
  LayerFiles layers;   // likewise
  bool keep_reports = false;
  bool progress = false;  // on stderr
  std::string label;      // begins each line of progress
};

// Renders and writes `jobs`; pictures are encoded while the next frames render. The records are in the order of the jobs. The first failure
// cancels the open frames and is returned; Ctrl-C does the same with Cancelled.
Result<std::vector<FrameRecord>> RenderFrames(Client& client, const std::vector<FrameJob>& jobs, const FrameLoopOptions& options);

}  // namespace slabstream

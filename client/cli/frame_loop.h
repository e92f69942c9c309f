// Renders frames in sequence, with some requested ahead. Shared by `render` (one frame), `turntable` and `bench`.
#pragma once

#include <string>
#include <vector>

#include "client/cli/picture_sink.h"
#include "client/client.h"
#include "common/base/status.h"

namespace slabstream {

// Figures of a finished frame.
struct FrameRecord {
  std::string output;
  Duration latency{};          // request to last byte
  Time received{};             // when the last byte was there
  FrameStatistics statistics;  // reports only if they were asked for
  bool empty = false;          // the picture shows nothing
  bool direct = false;         // it came straight from a worker, not through the coordinator
};

struct FrameLoopOptions {
  int in_flight = 1;
  PictureSink* pictures = nullptr;  // where they go; null: nowhere
  bool keep_reports = false;
  // If set, the loop goes on after a frame that fails, and adds the failure here, with the frame's number and output. A failure before the
  // first picture, or the third failure in a row, still ends the loop. Null: every failure ends it.
  std::vector<Status>* failures = nullptr;
  bool progress = false;  // on stderr
  std::string label;      // begins each line of progress
};

// Renders `jobs`; pictures are put while the next frames render. At most in_flight frames are open, and at most as many more wait to be put
// or are being put: so a slow sink stops requests, and pictures do not pile up. The records of the pictures are in the order of the jobs. A
// failure that ends the loop cancels the open frames and is returned; Ctrl-C does the same with Cancelled.
Result<std::vector<FrameRecord>> RenderFrames(Client& client, const std::vector<FrameJob>& jobs, const FrameLoopOptions& options);

}  // namespace slabstream

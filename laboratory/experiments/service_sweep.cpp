#include "laboratory/experiments/service_sweep.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/cli/service_connection.h"
#include "laboratory/experiments/service_frames.h"
#include "laboratory/experiments/service_roster.h"

namespace slabstream {

void RunServiceSweep(ExperimentContext& context, const Sweep& sweep, Results& results) {
  ServiceConnection connection = OrThrow(ServiceConnection::OpenService(context.options().own.service));
  const StatusReply begin = OrThrow(connection.client().QueryStatus());
  const Json roster = RosterOf(begin);
  const std::vector<SweepFrame> frames = FramesOf(sweep);
  std::vector<Trial> trials;
  trials.reserve(frames.size());
  for (const SweepFrame& asked : frames) trials.push_back(ServiceFramesTrial(connection.client(), begin, asked.frame));
  context.Run(trials);

  for (std::size_t i = 0; i < frames.size(); ++i) {
    FrameCase frame = frames[i].frame;
    frame.workers = int(roster.size());
    Json columns = ColumnsOf(frame);
    columns.update(frames[i].names);
    AddServiceFrames(results, columns, context.log(), trials[i]);
  }
  AttachRoster(results, roster);
}

}  // namespace slabstream

// The frames of tables 2, 5 and 6 and figures 9, 10 and 11 at a running service: real processes, with as many workers as it has.
#include "client/cli/service_connection.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/service_frames.h"
#include "laboratory/experiments/service_roster.h"

namespace slabstream {
namespace {

std::vector<FrameCase> Frames(const PaperSetup& setup, int workers) {
  std::vector<FrameCase> frames;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const int size : setup.sizes()) frames.push_back(setup.Frame(renderer, size, workers));
    if (workers == 1) continue;
    frames.push_back(setup.Frame(renderer, setup.table_size(), workers));
    frames.back().policy.combine = "centralized";
    frames.push_back(setup.Frame(renderer, setup.table_size(), workers));
    frames.back().policy.axis = AxisChoice::kAuto;
  }
  return frames;
}

}  // namespace

void RunPaperAtService(ExperimentContext& context, const PaperSetup& setup, Results& results) {
  ServiceConnection connection = OrThrow(ServiceConnection::OpenService(context.options().own.service));
  const StatusReply begin = OrThrow(connection.client().QueryStatus());
  const Json roster = RosterOf(begin);
  const std::vector<FrameCase> frames = Frames(setup, int(roster.size()));
  std::vector<Trial> trials;
  trials.reserve(frames.size());
  for (const FrameCase& frame : frames) trials.push_back(ServiceFramesTrial(connection.client(), begin, frame));
  context.Run(trials);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Json of = {{"part", "service frames"}};
    of.update(ColumnsOf(frames[i]));
    AddServiceFrames(results, of, context.log(), trials[i]);
  }
  AttachRoster(results, roster);
}

}  // namespace slabstream

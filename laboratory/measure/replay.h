// Replay: simulates recorded frames (recording.h) in virtual time. Unchanged, they show how far the simulation can be trusted with them.
// Under another policy or on another machine, they keep the measured costs of boxes and the same images.
#pragma once

#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/cli/recording.h"
#include "common/base/status.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

// The changes; an empty field stays as recorded.
struct ReplayChange {
  std::string combine;            // in the syntax of --combine
  std::optional<LinkModel> link;  // between workers on separate hosts
  std::optional<int> workers;     // at least 1, at most the boxes of the frame with fewest; box i goes to worker i mod workers
};

// "combine=SCHEME", "link=LINK" (ParseLink) or "workers=N", each at most once. InvalidArgument names the text.
Result<ReplayChange> ParseReplayChange(std::span<const std::string> texts);

// Means over frames that fetched no voxels (over all if there is none such).
struct ReplayedRun {
  double latency = 0;            // seconds
  double frames_per_second = 0;  // over all
  double imbalance = 1, idle_share = 0;
  double image_bytes = 0;
};

struct ReplayReport {
  int in_flight = 1;  // frames that were requested ahead, as the recording shows
  ReplayedRun measured, as_it_was, changed;
};

// Applies the changes to `machine`, the host that the trace was recorded on or a similar one. With another link, images travel in messages.
MachineModel ChangedMachine(const MachineModel& machine, const ReplayChange& change);

// Errors: InvalidArgument (more workers than boxes).
Result<ReplayReport> Replay(std::span<const RecordedFrame> frames, const ReplayChange& change, const MachineModel& machine,
                            const MachineModel& changed_machine);

struct ReplayOptions {
  std::string trace_path;
  std::vector<std::string> changes;  // in the syntax of ParseReplayChange
};

// Reads, calibrates this host, replays and prints a table. InvalidArgument, NotFound: options or file.
Status RunReplay(const ReplayOptions& options, std::ostream& out);

}  // namespace slabstream

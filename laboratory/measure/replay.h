// Replay: frames that were recorded (recording.h) once more, in virtual time: as they were, which shows how far the simulation can be
// trusted with them, and under another policy or on another machine, with the same measured costs of boxes and the same images.
#pragma once

#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/cli/recording.h"
#include "common/base/status.h"
#include "common/simulation/machine_model.h"

namespace slabstream {

// What is to be different; what is empty stays as it was.
struct ReplayChange {
  std::string combine;            // as --combine takes it
  std::optional<LinkModel> link;  // between workers that have a host each
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
  int in_flight = 1;  // frames that were asked for ahead, as the recording shows
  ReplayedRun measured, as_it_was, changed;
};

// The machine with the changes: what `machine`, the host that the trace was recorded on or one like it, becomes under another link.
// Images then travel in messages.
MachineModel ChangedMachine(const MachineModel& machine, const ReplayChange& change);

// Errors: InvalidArgument (more workers than boxes).
Result<ReplayReport> Replay(std::span<const RecordedFrame> frames, const ReplayChange& change, const MachineModel& machine,
                            const MachineModel& changed_machine);

struct ReplayOptions {
  std::string trace_path;
  std::vector<std::string> changes;  // as ParseReplayChange takes them
};

// Reads, calibrates this host, replays and prints a table. InvalidArgument, NotFound: options or file.
Status RunReplay(const ReplayOptions& options, std::ostream& out);

}  // namespace slabstream

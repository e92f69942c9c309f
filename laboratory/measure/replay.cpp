#include "laboratory/measure/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <ostream>
#include <sstream>

#include "common/combining/schemes.h"
#include "common/planning/placement.h"
#include "common/renderers/renderer_kind.h"
#include "common/text/parse_number.h"
#include "laboratory/measure/calibrate.h"
#include "laboratory/measure/combining_costs.h"
#include "simulator/simulate_frames.h"

namespace slabstream {
namespace {

// A frame as input of the simulation; FrameInput points into it.
struct Replayed {
  FramePlan plan;
  std::vector<CoverageMap> coverage;
  FrameInput input;
};

std::size_t BoxesOf(const RecordedFrame& frame) {
  std::size_t boxes = 0;
  for (const auto& group : frame.groups) boxes += group.size();
  return boxes;
}

// The recorded groups, or the same boxes in the same order in groups of `workers`.
std::vector<std::vector<RecordedRank>> Regroup(const RecordedFrame& frame, const std::optional<int>& workers) {
  if (!workers) return frame.groups;
  std::vector<std::vector<RecordedRank>> groups;
  std::size_t placed = 0;
  for (const auto& group : frame.groups) {
    for (RecordedRank rank : group) {
      if (placed++ % std::size_t(*workers) == 0) groups.emplace_back();
      rank.worker = rank.box % WorkerId(*workers) + 1;
      groups.back().push_back(rank);
    }
  }
  return groups;
}

void MakeReplayed(const RecordedFrame& frame, const ReplayChange& change, const WakeUps& wake_ups, Replayed& out) {
  const std::vector<std::vector<RecordedRank>> groups = Regroup(frame, change.workers);
  const std::string& combine = change.combine.empty() ? frame.combine : change.combine;
  FramePlan& plan = out.plan;
  SetRenderer(*frame.renderer, plan.setup);
  plan.setup.camera.width = plan.setup.sheets.width = frame.grid.width();
  plan.setup.camera.height = plan.setup.sheets.height = frame.grid.height();
  plan.slots = change.workers ? std::uint32_t(*change.workers) : frame.workers;
  plan.combine = combine;
  plan.display = frame.display;
  if (change.workers) {
    // As the planner chooses: the owner of the nearest box.
    const auto first = std::find_if(groups.begin(), groups.end(), [](const auto& group) { return !group.empty(); });
    plan.display = first->front().worker;
  }

  out.coverage.reserve(BoxesOf(frame));
  BoxId number = 0;
  for (const std::vector<RecordedRank>& recorded : groups) {
    GroupPlan& group = plan.groups.emplace_back();
    for (const RecordedRank& rank : recorded) {
      // A rank without a report cost nothing, wherever it was.
      group.placements.push_back({number++, {}, rank.worker == 0 ? plan.display : rank.worker});
      out.coverage.push_back(UniformCoverage(rank.bounds, rank.pixels, frame.grid.width(), frame.grid.height()));
      out.input.boxes.push_back({rank.render_seconds, &out.coverage.back(), 0});
    }
    group.schedule = {combine, Rank(group.placements.size()), {RootOf(group, plan.display)}};
  }
  out.input.plan = &plan;
  out.input.finish_seconds = frame.picture_seconds;
  // The time spent outside the coordinator, less the simulated part of it: the wake-ups of the request and of the picture.
  const double outside = frame.latency - (frame.end - frame.arrived);
  out.input.receive_seconds = std::max(outside - wake_ups.awake - wake_ups.asleep, 0.0);
}

bool Warm(const RecordedFrame& frame) { return frame.voxel_bytes == 0; }

// Mean of `value(i)` over the frames that count.
template <class Value>
double MeanOf(std::span<const RecordedFrame> frames, Value&& value) {
  const bool any_warm = std::any_of(frames.begin(), frames.end(), Warm);
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (any_warm && !Warm(frames[i])) continue;
    sum += value(i);
    ++count;
  }
  return sum / count;
}

// Most / mean render time of a worker, as in --stats.
double ImbalanceOf(const RecordedFrame& frame) {
  std::map<WorkerId, double> seconds;
  double most = 0, total = 0;
  for (const auto& group : frame.groups) {
    for (const RecordedRank& rank : group) {
      most = std::max(most, seconds[rank.worker] += rank.render_seconds);
      total += rank.render_seconds;
    }
  }
  return total > 0 ? most * double(std::max<std::size_t>(frame.workers, seconds.size())) / total : 1;
}

ReplayedRun Measured(std::span<const RecordedFrame> frames) {
  ReplayedRun run;
  run.latency = MeanOf(frames, [&](std::size_t i) { return frames[i].latency; });
  run.imbalance = MeanOf(frames, [&](std::size_t i) { return ImbalanceOf(frames[i]); });
  run.image_bytes = MeanOf(frames, [&](std::size_t i) { return frames[i].image_bytes; });
  const double span = frames.back().end - frames.front().arrived;
  run.frames_per_second = span > 0 ? double(frames.size()) / span : 0;
  return run;
}

Result<ReplayedRun> Simulated(std::span<const RecordedFrame> frames, const ReplayChange& change, const MachineModel& machine,
                              int in_flight) {
  std::vector<Replayed> replayed(frames.size());
  std::vector<FrameInput> inputs;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    MakeReplayed(frames[i], change, machine.wake_ups, replayed[i]);
    inputs.push_back(replayed[i].input);
  }
  const Result<Timeline> timeline = SimulateFrames(inputs, machine, {.in_flight = in_flight, .keep_spans = false});
  if (!timeline.ok()) return timeline.status();
  const auto mean = [&](auto&& value) { return MeanOf(frames, [&](std::size_t i) { return value(timeline->frames[i]); }); };
  ReplayedRun run;
  run.latency = mean([](const SimulatedFrame& frame) { return frame.latency(); });
  run.imbalance = mean([](const SimulatedFrame& frame) { return frame.imbalance; });
  run.idle_share = mean([](const SimulatedFrame& frame) { return frame.idle_share; });
  run.image_bytes = mean([](const SimulatedFrame& frame) { return frame.image_bytes; });
  run.frames_per_second = timeline->frames_per_second();
  return run;
}

// The largest number of frames requested and not yet complete.
int InFlight(std::span<const RecordedFrame> frames) {
  int most = 1;
  for (const RecordedFrame& frame : frames) {
    const auto open = std::count_if(frames.begin(), frames.end(), [&](const RecordedFrame& other) {
      return other.arrived <= frame.arrived && other.end > frame.arrived;
    });
    most = std::max(most, int(open));
  }
  return most;
}

std::string RowText(const char* name, const ReplayedRun& run, bool idle_known) {
  return fmt::format("{:24} {:>10.2f} {:>10.2f} {:>10.2f} {:>8} {:>12.2f}\n", name, run.latency * 1e3, run.frames_per_second, run.imbalance,
                     idle_known ? fmt::format("{:.1f} %", run.idle_share * 100) : "-", run.image_bytes / (1 << 20));
}

}  // namespace

Result<ReplayChange> ParseReplayChange(std::span<const std::string> texts) {
  ReplayChange change;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string key = text.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : text.substr(equals + 1);
    const bool again =
        (key == "combine" && !change.combine.empty()) || (key == "link" && change.link) || (key == "workers" && change.workers);
    if (again) return Status::InvalidArgument(fmt::format("--with {}: {} is given twice", text, key));
    if (key == "combine") {
      if (value == kAutomatic) {
        return Status::InvalidArgument(fmt::format("--with {}: a replay needs the name of one scheme", text));
      }
      if (const auto scheme = ParseCombining(value); !scheme.ok()) {
        return Status::InvalidArgument(fmt::format("--with {}: {}", text, scheme.status().message()));
      }
      change.combine = value;
    } else if (key == "link") {
      const Result<LinkModel> link = ParseLink("--with link", value);
      if (!link.ok()) return link.status();
      change.link = *link;
    } else if (key == "workers") {
      const std::optional<int> workers = ParseNumber<int>(value);
      if (!workers || *workers < 1) {
        return Status::InvalidArgument(fmt::format("--with {}: '{}' is no number of workers from 1 on", text, value));
      }
      change.workers = *workers;
    } else {
      return Status::InvalidArgument(fmt::format("--with {}: must be combine=SCHEME, link=LINK or workers=N", text));
    }
  }
  return change;
}

MachineModel ChangedMachine(const MachineModel& machine, const ReplayChange& change) {
  MachineModel changed = machine;
  if (!change.link) return changed;
  changed.link = *change.link;
  changed.combining = MeasureCombining(change.link->contention == Contention::kNone ? ImageTransfer::kLent : ImageTransfer::kMessage);
  return changed;
}

Result<ReplayReport> Replay(std::span<const RecordedFrame> frames, const ReplayChange& change, const MachineModel& machine,
                            const MachineModel& changed_machine) {
  if (frames.empty()) return Status::InvalidArgument("the trace holds no frames");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t boxes = BoxesOf(frames[i]);
    if (change.workers && std::size_t(*change.workers) > boxes) {
      return Status::InvalidArgument(fmt::format("--with workers={}: frame {} was rendered in {} boxes, so at most {} workers can share it",
                                                 *change.workers, i, boxes, boxes));
    }
  }
  ReplayReport report;
  report.in_flight = InFlight(frames);
  report.measured = Measured(frames);
  const auto for_recorded_times = [](MachineModel model) {
    model.workers_a_host = 0;  // the recorded times include the slowdown by neighbours
    model.client_seconds = 0;  // each frame has its own time at the client
    return model;
  };
  const Result<ReplayedRun> same = Simulated(frames, {}, for_recorded_times(machine), report.in_flight);
  if (!same.ok()) return same.status();
  const Result<ReplayedRun> other = Simulated(frames, change, for_recorded_times(changed_machine), report.in_flight);
  if (!other.ok()) return other.status();
  report.as_it_was = *same;
  report.changed = *other;
  return report;
}

Status RunReplay(const ReplayOptions& options, std::ostream& out) {
  const Result<ReplayChange> change = ParseReplayChange(options.changes);
  if (!change.ok()) return change.status();
  std::ifstream file(options.trace_path, std::ios::binary);
  if (!file) return Status::NotFound(fmt::format("{} cannot be read", options.trace_path));
  std::ostringstream text;
  text << file.rdbuf();
  const Result<std::vector<RecordedFrame>> frames = ParseRecording(text.str());
  if (!frames.ok()) return Status(frames.status().code(), fmt::format("{}: {}", options.trace_path, frames.status().message()));
  const Result<MachineModel> machine = CalibrateThisHost(int(frames->front().workers));
  if (!machine.ok()) return machine.status();
  const Result<ReplayReport> report = Replay(*frames, *change, *machine, ChangedMachine(*machine, *change));
  if (!report.ok()) return report.status();

  out << fmt::format("{} frames of {} workers, {} in flight, {}; means of frames that fetched no voxels\n", frames->size(),
                     frames->front().workers, report->in_flight, frames->front().combine);
  out << fmt::format("{:24} {:>10} {:>10} {:>10} {:>8} {:>12}\n", "", "latency ms", "frames/s", "imbalance", "idle", "images MiB");
  out << RowText("measured", report->measured, false);
  out << RowText("simulated as it was", report->as_it_was, true);
  if (!options.changes.empty()) out << RowText("simulated with changes", report->changed, true);
  out << fmt::format("The simulation of the unchanged frames is off by {:+.1f} %.\n",
                     100 * (report->as_it_was.latency / report->measured.latency - 1));
  return Status::Ok();
}

}  // namespace slabstream

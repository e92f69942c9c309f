#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/report/charts.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 5, kQuickRepeats = 1, kServiceFrames = 5;
constexpr double kMebibyte = 1 << 20;

struct Streams {
  std::vector<BenchCase> volumes;
  std::vector<int> groups, workers;
  int pixels = 512;
  FrameCase Frame(const BenchCase& volume, int workers_count, int group_count) const {
    FrameCase frame{volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), {}, workers_count};
    frame.policy.groups = group_count;
    return frame;
  }
};

Streams StreamsOf(const ExperimentContext& context) {
  Streams streams;
  const int size = context.Scaled(context.quick() ? 128 : 300);
  streams.volumes = {StandardSphere(SphereClass::kHollow, size), StandardSphere(SphereClass::kFilled, size)};
  const std::vector<BenchCase> real = RealVolumes(context.options().volumes);
  if (!context.quick()) streams.volumes.insert(streams.volumes.end(), real.begin(), real.end());
  streams.groups = context.quick() ? std::vector{1, 2, 4} : std::vector{1, 2, 3, 4, 6, 8, 12, 16};
  streams.workers = context.quick() ? std::vector{2, 8} : std::vector{2, 4, 16};
  streams.pixels = context.Scaled(512);
  return streams;
}

// Bytes of voxels that a worker must hold while frames stream through it without a cache: those of two groups.
double WindowBytes(const MeasuredFrame& frame) {
  double most = 0;
  for (std::size_t g = 0; g < frame.plan.groups.size(); ++g) {
    double in_group = 0;
    for (const std::size_t group : {g, g + 1}) {
      if (group >= frame.plan.groups.size()) continue;
      double largest = 0;
      for (const Placement& placement : frame.plan.groups[group].placements)
        largest = std::max(largest, frame.boxes[placement.id].voxel_bytes);
      in_group += largest;
    }
    most = std::max(most, in_group);
  }
  return most;
}

}  // namespace

Report RunStreaming(ExperimentContext& context) {
  const Streams streams = StreamsOf(context);
  std::vector<Trial> trials = {HostTrial()};
  for (const BenchCase& volume : streams.volumes) {
    trials.push_back(FinishTrial(context, streams.Frame(volume, 1, 1)));
    trials.push_back(BoxCostTrial(context, streams.Frame(volume, 1, 1)));
    for (const int groups : streams.groups) {
      for (const int p : streams.workers) trials.push_back(BoxCostTrial(context, streams.Frame(volume, p, groups)));
      trials.push_back(ServiceTrial(context, streams.Frame(volume, 2, groups), kServiceFrames));
    }
  }
  context.Run(std::move(trials), kRepeats, kQuickRepeats);

  Report report;
  report.title = "Streaming: groups of slabs";
  report.summary =
      "A volume is divided into groups of slabs that pass through the workers one after the other: the next group renders while the last "
      "one is combined. More groups need less memory "
      "and show a first preview sooner; what do they cost?";
  const MachineModel machine = Cluster(context, Link("10gbit"));
  for (const BenchCase& volume : streams.volumes) {
    Table table{fmt::format("groups-{}", volume.dataset),
                volume.purpose,
                {"p", "groups", "frame (ms)", "first preview (ms)", "picture to picture (ms)", "efficiency (%)", "voxels of a worker (MiB)",
                 "service at p = 2 (ms)"},
                {}};
    LineChart efficiency{"Efficiency, frames asked for ahead", {"groups", ""}, {"efficiency", "%", AxisScale::kLinear, true}, {}};
    LineChart memory{"Voxels that a worker must hold", {"groups", ""}, {"memory", "MiB", AxisScale::kLinear, true}, {}};
    LineChart preview{"Time to the first preview", {"groups", ""}, {"time", "ms", AxisScale::kLinear, true}, {}};
    const FrameFigures one = FindFigures(Recall(context, streams.Frame(volume, 1, 1)), machine);
    std::string sentence;
    for (const int p : streams.workers) {
      LineSeries of_efficiency{fmt::format("p = {}", p), Origin::kSimulated, {}};
      LineSeries of_memory{of_efficiency.name, Origin::kMeasured, {}}, of_preview = of_efficiency;
      LineSeries of_frame{fmt::format("p = {}, whole frame", p), Origin::kSimulated, {}};
      for (const int groups : streams.groups) {
        const FrameCase frame = streams.Frame(volume, p, groups);
        const MeasuredFrame measured = Recall(context, frame);
        const FrameFigures figures = FindFigures(measured, machine);
        const double percent = 100 * one.steady_seconds / figures.steady_seconds / p, mebibytes = WindowBytes(measured) / kMebibyte;
        of_efficiency.points.push_back({double(groups), percent});
        of_memory.points.push_back({double(groups), mebibytes});
        of_preview.points.push_back({double(groups), figures.preview_seconds * 1e3});
        of_frame.points.push_back({double(groups), figures.latency_seconds * 1e3});
        Cell service;
        if (p == 2) service = Measured(EstimateOf(context.log(), ServiceKey(context, frame, kServiceFrames), "latency_ms"));
        table.rows.push_back({Chosen(p), Chosen(groups), Simulated(figures.latency_seconds * 1e3), Simulated(figures.preview_seconds * 1e3),
                              Simulated(figures.steady_seconds * 1e3), Simulated(percent), Measured(mebibytes), service});
      }
      const LinePoint first = of_preview.points.front(), last = of_preview.points.back();
      sentence = fmt::format(
          "At p = {}, {:.0f} groups instead of one show a first preview after {:.1f} ms instead of {:.1f} ms and a worker must hold {:.1f} "
          "MiB of voxels instead of {:.1f} MiB; efficiency goes "
          "from {:.0f} % to {:.0f} %.",
          p, last.x, last.y, first.y, of_memory.points.back().y, of_memory.points.front().y, of_efficiency.points.front().y,
          of_efficiency.points.back().y);
      efficiency.series.push_back(std::move(of_efficiency));
      memory.series.push_back(std::move(of_memory));
      preview.series.insert(preview.series.end(), {std::move(of_preview), std::move(of_frame)});
    }
    Section section;
    section.title = volume.dataset;
    section.question = fmt::format("{}: how many groups?", volume.purpose);
    section.method = fmt::format(
        "Equal slabs, {0} x {0} pixels, the tree; every slab is rendered alone on one thread, frames are simulated on a switched network "
        "of 10 Gbit/s with all that a service does around a frame. Efficiency compares picture to picture, as many frames asked for ahead "
        "as keep all workers busy, "
        "with one worker and one group. A worker must hold the slabs of two groups and their halos; those it has room for besides stay "
        "cached.",
        streams.pixels);
    section.answer = sentence;
    section.blocks = {Figure{"efficiency-" + volume.dataset, DrawLines(efficiency),
                             "What more groups cost: halos are rendered again and again, and every group has its own combining."},
                      Figure{"memory-" + volume.dataset, DrawLines(memory), "Counted from the boxes: two groups with their halos."},
                      Figure{"preview-" + volume.dataset, DrawLines(preview), "The nearest group alone, and all of the frame."},
                      std::move(table)};
    const MeasuredFrame shown = Recall(context, streams.Frame(volume, streams.workers[1], streams.groups[2]));
    const Timeline timeline = Simulate(shown, machine, 3, 3, true);
    section.blocks.emplace_back(
        TimelineFigure("timeline-" + volume.dataset, fmt::format("Three frames, p = {}, {} groups", streams.workers[1], streams.groups[2]),
                       timeline, 0, timeline.end, "Group g + 1 renders while group g is combined, across frames too."));
    report.sections.push_back(std::move(section));
  }
  return report;
}

}  // namespace slabstream

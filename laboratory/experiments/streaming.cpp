#include <algorithm>

#include "laboratory/experiments/attachments.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/policies.h"

namespace slabstream {
namespace {

struct Streams {
  std::vector<BenchCase> volumes;
  std::vector<int> groups, workers;
  int pixels = 512;
  FrameCase Frame(const BenchCase& volume, int workers_count, int group_count) const {
    FrameCase frame{volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), EqualSlabs().policy, workers_count};
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

void RunStreaming(ExperimentContext& context, Results& results) {
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
  context.Run(std::move(trials));

  const auto add = [&](const FrameCase& frame) {
    Json of = ColumnsOf(frame);
    of["link"] = kLink;
    AddFigures(results, of, RecallFigures(context, frame, Link(kLink)));
    results.Add(of, "memory", WindowBytes(Recall(context, frame)), Origin::kMeasured);
  };
  for (const BenchCase& volume : streams.volumes) {
    add(streams.Frame(volume, 1, 1));
    for (const int groups : streams.groups) {
      for (const int p : streams.workers) add(streams.Frame(volume, p, groups));
      const FrameCase two = streams.Frame(volume, 2, groups);
      Json of = ColumnsOf(two);
      of["link"] = "host";
      results.Add(of, "latency", ValuesOf(context.log(), ServiceKey(context, two, kServiceFrames), "latency_ms", 1e-3), Origin::kMeasured);
    }
    const MeasuredFrame shown = Recall(context, streams.Frame(volume, streams.workers[1], streams.groups[2]));
    AttachTimeline(results, "timeline-" + volume.dataset, Simulate(shown, Cluster(context, Link(kLink)), 3, 3, true));
  }
}

}  // namespace slabstream

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/base/time.h"

#include "common/planning/placement.h"
#include "common/planning/resolved_policy.h"
#include "common/wire/any_message.h"
#include "common/wire/control_messages.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/failure.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/policies.h"

namespace slabstream {
namespace {

constexpr int kTeam = 2;                 // workers that share a frame, in series with teams
constexpr int kMostDynamicWorkers = 64;  // measuring more boxes frame after frame takes long

FrameCase FrameOf(const BenchCase& volume, int pixels, const Policy& policy, int workers) {
  return {volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), policy, workers};
}

// The same policy for different numbers of workers. The volume may grow with them.
struct Series {
  std::string name;
  std::vector<FrameCase> frames;  // by workers, 1 first
  int team = 0;                   // workers that share a frame; 0: all workers of the frame

  int TeamOf(const FrameCase& frame) const { return team == 0 ? frame.workers : std::min(team, frame.workers); }
  // The frame that is measured for it.
  FrameCase Shared(FrameCase frame) const {
    frame.workers = TeamOf(frame);
    return frame;
  }
};

std::vector<Series> StrongSeries(const ExperimentContext& context, const RendererKind* renderer) {
  const std::vector<int> workers = context.quick() ? std::vector{1, 4, 16, 64} : std::vector{1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024};
  const int size = context.Scaled(context.quick() ? 128 : 300), pixels = context.Scaled(512);
  std::vector<Series> all;
  const BenchCase sphere = StandardSphere(SphereClass::kHollow, size, renderer);
  const auto add = [&](const std::string& name, const Policy& policy, int team = 0) {
    Series& series = all.emplace_back(Series{name, {}, team});
    for (const int p : workers) {
      if (!IsDynamic(policy) || p <= kMostDynamicWorkers) series.frames.push_back(FrameOf(sphere, pixels, policy, p));
    }
  };
  for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
    for (const std::string& scheme : UsualSchemes()) add(fmt::format("{}, {}", named.name, scheme), Combined(named.policy, scheme));
  }
  Policy balanced = EqualSlabs().policy;
  balanced.balance = kDynamicBalance;
  add("slabs, dynamic balance", balanced);
  add(fmt::format("slabs, teams of {}", kTeam), EqualSlabs().policy, kTeam);
  return all;
}

// Equally many voxels for each worker, for any number of workers.
std::vector<Series> WeakSeries(const ExperimentContext& context) {
  const std::vector<int> workers = context.quick() ? std::vector{1, 8} : std::vector{1, 2, 4, 8, 16, 32, 64};
  const int one = context.Scaled(context.quick() ? 48 : 96), pixels = context.Scaled(512);
  std::vector<Series> all;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
      Series series{named.name, {}};
      for (const int p : workers) {
        const int size = int(std::lround(one * std::cbrt(double(p))));
        series.frames.push_back(FrameOf(StandardSphere(SphereClass::kFilled, size, renderer), pixels, named.policy, p));
      }
      all.push_back(std::move(series));
    }
  }
  return all;
}

// One frame for more workers than a network has: what the workers do, and what the one coordinator does for it.
std::vector<FrameCase> FramesOfMany(const ExperimentContext& context) {
  std::vector<FrameCase> frames;
  const BenchCase sphere = StandardSphere(SphereClass::kHollow, context.Scaled(context.quick() ? 128 : 300), Splatting());
  for (const std::string& scheme : UsualSchemes()) {
    const Policy policy = Combined(BalancedTree().policy, scheme);
    for (const int p : context.quick() ? std::vector{16, 64} : std::vector{16, 64, 256, 1024, 4096})
      frames.push_back(FrameOf(sphere, context.Scaled(512), policy, p));
  }
  return frames;
}

// What the coordinator sends so that workers render the frame's group.
GroupAssignment AssignmentOf(const FramePlan& plan) {
  constexpr std::size_t kKeyLetters = 40;  // of CURVE
  GroupAssignment assignment{.epoch = 1, .key = {1, 1, 0}, .display = plan.display, .setup = plan.setup, .group = plan.groups.front()};
  for (WorkerId worker = 1; worker <= plan.slots; ++worker) {
    assignment.peers.push_back(
        {worker, fmt::format("tcp://10.{}.{}.1:45678", worker / 256, worker % 256), worker, std::string(kKeyLetters, 'k')});
  }
  return assignment;
}

double ShortestSeconds(auto&& work) {
  constexpr int kTimes = 5;
  double shortest = 0;
  for (int i = 0; i < kTimes; ++i) {
    const Time begin = MonotonicNow();
    work();
    const double passed = std::chrono::duration<double>(MonotonicNow() - begin).count();
    if (i == 0 || passed < shortest) shortest = passed;
  }
  return shortest;
}

// What one frame costs the coordinator, and each worker that hears of it; one thread.
Json MeasureHandOut(ExperimentContext& context, const FrameCase& frame) {
  const FramePlan plan = PlanOf(context, frame);
  const ResolvedPolicy policy = Resolve(context, frame).policy;
  const GroupAssignment assignment = AssignmentOf(plan);
  std::vector<std::byte> message;
  const double plan_seconds = ShortestSeconds([&] { (void)PlanFrame(plan.setup, policy, RosterOf(plan.slots), plan.layout); });
  const double encode_seconds = ShortestSeconds([&] { message = Encode(assignment); });
  const double decode_seconds = ShortestSeconds([&] { OrThrow(Decode<CoordinatorToWorker>(message, 0)); });
  return {{"plan_seconds", plan_seconds},
          {"encode_seconds", encode_seconds},
          {"decode_seconds", decode_seconds},
          {"message_bytes", double(message.size())}};
}

KeyedFrame ForHandOut(ExperimentContext& context, const FrameCase& frame) { return WholeCase(context, "hand-out", frame); }

// Of a frame that is alone, and of the coordinator's part in it.
void AddFrameOfMany(ExperimentContext& context, const FrameCase& frame, Results& results) {
  const Json hand_out = ForHandOut(context, frame).key;
  const auto of_coordinator = [&](const char* number) { return EstimateOf(context.log(), hand_out, number); };
  const auto columns = [&](std::string_view variant) {
    Json of = ColumnsOf(frame);
    of.update(Json{{"part", "many workers"}, {"variant", variant}, {"teams", 1}, {"link", kLink}});
    return of;
  };
  const MeasuredFrame measured = Recall(context, frame);
  MachineModel machine = Cluster(context, Link(kLink));
  MachineModel at_once = machine;
  at_once.plan_seconds = at_once.message_seconds = 0;
  // The coordinator's wire carries the same message to one worker after the other.
  machine.plan_seconds = of_coordinator("plan_seconds").median + of_coordinator("encode_seconds").median;
  machine.message_seconds += of_coordinator("message_bytes").median / machine.link.bytes_per_second;
  for (const auto& [variant, model] : {std::pair("one coordinator", &machine), std::pair("a coordinator that takes no time", &at_once)}) {
    const Timeline timeline = Simulate(measured, *model);
    const SimulatedFrame& alone = timeline.frames.front();
    results.Add(columns(variant), "latency", std::vector{alone.latency()}, Origin::kSimulated);
    results.Add(columns(variant), "idle_share", std::vector{alone.idle_share}, Origin::kSimulated);
    results.Add(columns(variant), "image_bytes", std::vector{alone.image_bytes}, Origin::kSimulated);
  }
  results.Add(columns("one coordinator"), "hand_out_time", std::vector{frame.workers * machine.message_seconds + machine.plan_seconds},
              Origin::kSimulated);
  for (const auto& [metric, number] : {std::pair("plan_time", "plan_seconds"), std::pair("assignment_time", "encode_seconds"),
                                       std::pair("hearing_time", "decode_seconds"), std::pair("assignment_bytes", "message_bytes")}) {
    results.Add(columns("one coordinator"), metric, of_coordinator(number), Origin::kMeasured);
  }
}

}  // namespace

void RunScaling(ExperimentContext& context, Results& results) {
  std::vector<std::pair<std::string_view, std::vector<Series>>> parts = {{"weak", WeakSeries(context)}};
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) parts.emplace_back("strong", StrongSeries(context, renderer));
  std::vector<Trial> trials = {HostTrial()};
  for (const auto& [part, all] : parts) {
    for (const Series& series : all) {
      for (const FrameCase& frame : series.frames) {
        const FrameCase shared = series.Shared(frame);
        trials.push_back(CostTrial(context, shared));
        trials.push_back(FinishTrial(context, shared));
      }
    }
  }
  const std::vector<FrameCase> of_many = FramesOfMany(context);
  for (const FrameCase& frame : of_many) {
    trials.push_back(CostTrial(context, frame));
    trials.push_back(FinishTrial(context, frame));
    trials.push_back(ForHandOut(context, frame)
                         .MakeTrial(
                             context, [&context, frame] { return MeasureHandOut(context, frame); }, 0.1));
  }
  context.Run(std::move(trials));

  for (const FrameCase& frame : of_many) AddFrameOfMany(context, frame, results);
  for (const auto& [part, all] : parts) {
    for (const Series& series : all) {
      for (const FrameCase& frame : series.frames) {
        const int teams = frame.workers / series.TeamOf(frame);
        Json of = ColumnsOf(frame);
        of.update(Json{{"part", part}, {"variant", series.name}, {"teams", teams}, {"link", kLink}});
        AddFigures(results, of, RecallFigures(context, series.Shared(frame), Link(kLink), teams));
      }
    }
  }
}

}  // namespace slabstream

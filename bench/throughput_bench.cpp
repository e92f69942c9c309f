// The bounds on the throughput of many workers. For the paper's class-I sphere and some partitions: the render time of all boxes against
// that of the whole volume (the extra work), how even the workers are, and from both the efficiency that no schedule can exceed. Then
// frames simulated on a link, requested ahead: the time from picture to picture, and how busy each kind of resource is.
//
//   build/bin/throughput_bench [--size N] [--workers P] [--team M] [--renderer splat|zbuffer] [--axis auto|view] [--frames F]
//                              [--schemes A B ...] [--links A B ...]
//
// Every box is rendered alone on one thread. Dynamic balance: the coordinator's table of layouts learns from F frames of that view.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "common/base/large_buffers.h"
#include "common/classification/count_occupied.h"
#include "common/planning/placement.h"
#include "common/planning/policy_names.h"
#include "common/planning/team.h"
#include "common/renderers/registry.h"
#include "common/wire/client_messages.h"
#include "coordinator/layout_table.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/measure/calibrate.h"
#include "laboratory/measure/combining_costs.h"
#include "laboratory/measure/frame_costs.h"
#include "simulator/simulate_frames.h"

namespace slabstream {
namespace {

struct Options {
  int size = 300, workers = 30, repeats = 5, frames = 6;
  std::string renderer = "splat";
  std::vector<std::string> decompositions = {"slab", "beam", "kd-tree"};
  std::vector<std::string> schemes = {"fan-in", "radix-k", "direct-send"};
  std::vector<std::string> links = {"pvs", "10gbit"};
  int team = 0;  // workers that share a frame; 0: all
  AxisChoice axis = AxisChoice::kAuto;
};

struct Subject {
  std::shared_ptr<const Volume> volume;
  VolumeSummary summary;
  FrameRequest request;
  TransferFunction transfer;
  std::shared_ptr<const OccupancyGrid> occupied;
};

Subject MakeSubject(const Options& options) {
  const RendererKind* const renderer = RequireRenderer(options.renderer).value();
  const BenchCase sphere = SphereCase({SphereClass::kHollow, options.size, 0.05}, SphereOpacity(*renderer), renderer);
  Subject subject;
  subject.volume = LoadBenchVolume(sphere).value();
  subject.summary = Summarize(*subject.volume);
  ViewParameters view;
  view.azimuth_degrees = 30;
  view.elevation_degrees = 20;
  view.zoom = std::numbers::sqrt3;
  subject.request = BenchRequest(sphere, view, {options.size, options.size});
  subject.request.policy.groups = 1;
  subject.transfer = ResolveTransfer(subject.request.transfer, subject.summary).value();
  subject.occupied = std::make_shared<const OccupancyGrid>(
      CountOccupied(subject.volume->block, Classify(subject.transfer, subject.summary.description, subject.summary.range)));
  return subject;
}

struct Planned {
  FramePlan plan;
  FrameCosts costs;
  double all = 0, most = 0;  // render seconds: of all boxes, and of the worker with the most
};

// The frame after `frames` earlier ones.
Planned Plan(const Subject& subject, const Policy& policy, int workers, int frames, int repeats) {
  const Roster roster = RosterOf(std::uint32_t(workers));
  FrameRequest request = subject.request;
  request.policy = policy;
  const ResolvedPolicy resolved = ResolvePolicy(request, subject.summary.description.geometry).value();
  const ClassifiedVolume volume(1, subject.transfer, FindRenderer(request.renderer));
  LayoutTable layouts;
  Planned planned;
  for (int frame = 0; frame < frames; ++frame) {
    const std::shared_ptr<const Layout> layout =
        layouts.Find({&resolved, &volume, &subject.summary, subject.occupied, std::uint32_t(workers)});
    planned = {.plan = PlanFrame(request, 1, subject.summary, roster, layout).value(), .costs = {}};
    planned.costs = MeasureFrameCosts(*subject.volume, planned.plan, repeats);
    std::vector<RankReport> reports;
    std::map<WorkerId, double> seconds;
    for (const Placement& placement : planned.plan.groups.front().placements) {
      const double box = planned.costs.boxes[placement.id].seconds;
      planned.all += box;
      planned.most = std::max(planned.most, seconds[placement.worker] += box);
      RankReport& report = reports.emplace_back();
      report.box = placement.id;
      report.stage_ns[std::size_t(Stage::kRender)] = std::int64_t(box * 1e9);
    }
    layouts.Learn(volume, planned.plan, resolved, reports);
  }
  return planned;
}

MachineModel MachineFor(const std::string& link, double one_seconds, int size) {
  MachineModel machine;
  static const WakeUps wake_ups = CalibrateThisHost(1).value().machine.wake_ups;
  static const CombiningCosts messages = MeasureCombining(Transfer::kMessage);
  machine.combining = messages;
  machine.wake_ups = wake_ups;
  machine.client_seconds = 0;
  machine.link = ParseLink("link", link).value();
  machine.workers_a_host = 1;
  machine.cores_a_host = 2;
  if (link == "pvs") {
    // As laboratory/experiments/machines.cpp: the paper's ratio of computing to communicating, and no costs around a frame.
    machine.link.bytes_per_second = double(size) * size * machine.combining.rgba_bytes / (0.083 / 72.89 * one_seconds);
    machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
    machine.wake_ups = {.awake = 0, .asleep = 0};
    machine.combining.hidden_pixel = 0;
    machine.cores_a_host = 1;
  }
  return machine;
}

struct Flow {
  double steady = 0;
  double render = 0, combine = 0, finish = 0;  // the busiest worker's, a frame
  double in = 0, out = 0, bus = 0;             // the busiest wire's, a frame
  double messages = 0, megabytes = 0;
};

Flow Simulate(const FramePlan& plan, const FrameCosts& costs, const MachineModel& machine, bool paper, int teams) {
  FrameInput input = costs.Input(plan);
  if (paper) input.finish_seconds = input.receive_seconds = 0;
  const Roster everybody = RosterOf(plan.slots * std::uint32_t(teams));
  std::vector<FramePlan> plans;
  for (std::size_t turn = 0; turn < everybody.slots.size(); ++turn) {
    const Team team = TeamOf(everybody, std::uint32_t(teams), turn);
    plans.push_back(TakeTurn(plan, team.roster, team.turn));
  }
  // Whole rounds of the teams, since teams may end together. The middle half is evaluated.
  const int frames = 4 * teams * std::max((16 + teams - 1) / teams, 4);
  std::vector<FrameInput> inputs(std::size_t(frames), input);
  for (std::size_t i = 0; i < inputs.size(); ++i) inputs[i].plan = &plans[i % plans.size()];
  const Timeline timeline = SimulateFrames(inputs, machine, {.in_flight = std::min(frames, int(kMaxOpenRequests))}).value();
  Flow flow;
  std::vector<double> received;
  for (const SimulatedFrame& frame : timeline.frames) received.push_back(frame.received);
  std::sort(received.begin(), received.end());
  flow.steady = (received[std::size_t(3 * frames / 4) - 1] - received[std::size_t(frames / 4) - 1]) / (frames / 2);
  std::map<std::uint32_t, double> render, combine, finish, in, out;
  for (const SimulatedSpan& span : timeline.spans) {
    (span.lane == Lane::kRender ? render : span.lane == Lane::kCombine ? combine : finish)[span.worker] += (span.end - span.begin) / frames;
  }
  for (const SimulatedMessage& message : timeline.messages) {
    const double seconds = message.bytes / machine.link.bytes_per_second / frames;
    in[message.to] += seconds;
    out[message.from] += seconds;
    flow.bus += seconds;
    flow.messages += 1.0 / frames;
    flow.megabytes += message.bytes * 1e-6 / frames;
  }
  const auto most = [](const std::map<std::uint32_t, double>& seconds) {
    double all = 0;
    for (const auto& [worker, s] : seconds) all = std::max(all, s);
    return all;
  };
  flow.render = most(render);
  flow.combine = most(combine);
  flow.finish = most(finish);
  flow.in = most(in);
  flow.out = most(out);
  return flow;
}

void Run(const Options& options) {
  const Subject subject = MakeSubject(options);
  const Planned one = Plan(subject, {.groups = 1}, 1, 1, options.repeats);
  fmt::print("{}, N = {}: one worker renders {:.3f} ms, picture {:.3f} ms, client {:.3f} ms\n", options.renderer, options.size,
             one.all * 1e3, one.costs.picture.finish_seconds * 1e3, one.costs.picture.receive_seconds * 1e3);
  const double p = options.workers;
  const int team = options.team == 0 ? options.workers : options.team;
  for (const std::string& decomposition : options.decompositions) {
    for (const std::string split : {"voxels", "occupied", "cost"}) {
      Policy policy{.decomposition = decomposition, .load_metric = split, .axis = options.axis, .groups = 1};
      const bool dynamic = split == "cost";
      if (dynamic) policy.balance = kDynamicBalance;
      Planned planned = Plan(subject, policy, team, dynamic ? options.frames : 1, options.repeats);
      const double mean = planned.all / team;
      fmt::print("{:8} by {:9}: {} of {} workers a frame: {} boxes, work x {:.3f}, max/mean {:.3f}, longest {:.3f} ms: at most {:.1f} %\n",
                 decomposition, split, team, options.workers, planned.plan.groups.front().placements.size(), planned.all / one.all,
                 planned.most / mean, planned.most * 1e3, 100 * one.all / team / planned.most);
      for (const std::string& link : options.links) {
        const MachineModel machine = MachineFor(link, one.all, options.size);
        const Flow alone = Simulate(one.plan, one.costs, machine, link == "pvs", 1);
        for (const std::string& scheme : options.schemes) {
          FrameRequest request = subject.request;
          request.policy = policy;
          request.policy.combine = scheme;
          const FramePlan plan = PlanFrame(request, 1, subject.summary, RosterOf(std::uint32_t(team)), planned.plan.layout).value();
          const Flow flow = Simulate(plan, planned.costs, machine, link == "pvs", options.workers / team);
          fmt::print(
              "  {:7} {:12}: T1 {:.3f} ms, picture to picture {:.3f} ms, efficiency {:5.1f} %; busiest render {:.3f}, combine {:.3f}, "
              "picture {:.3f}, wire in "
              "{:.3f}, out {:.3f}, all {:.3f} ms; {:.0f} messages, {:.2f} MB\n",
              link, scheme, alone.steady * 1e3, flow.steady * 1e3, 100 * alone.steady / flow.steady / p, flow.render * 1e3,
              flow.combine * 1e3, flow.finish * 1e3, flow.in * 1e3, flow.out * 1e3, flow.bus * 1e3, flow.messages, flow.megabytes);
        }
      }
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  slabstream::KeepFrameBuffers();
  CLI::App app("What bounds the throughput of many workers");
  slabstream::Options options;
  app.add_option("--size", options.size, "N: voxels and pixels a side")->check(CLI::Range(16, 512))->capture_default_str();
  app.add_option("--workers", options.workers, "p")->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_option("--team", options.team, "workers that share a frame, a divisor of p; 0: all")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--renderer", options.renderer, "pipeline")->check(CLI::IsMember({"splat", "zbuffer"}))->capture_default_str();
  app.add_option("--axis", options.axis, "that is cut, or cut first")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, slabstream::AxisChoice>{{"auto", slabstream::AxisChoice::kAuto}, {"view", slabstream::AxisChoice::kView}}));
  app.add_option("--repeats", options.repeats, "renderings of each box")->check(CLI::Range(1, 100))->capture_default_str();
  app.add_option("--frames", options.frames, "that dynamic balance learns from")->check(CLI::Range(1, 100))->capture_default_str();
  app.add_option("--decompositions", options.decompositions, "of the volume");
  app.add_option("--schemes", options.schemes, "of combining");
  app.add_option("--links", options.links, "between workers");
  CLI11_PARSE(app, argc, argv);
  slabstream::Run(options);
  return 0;
}

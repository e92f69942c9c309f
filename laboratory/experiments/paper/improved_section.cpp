#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/paper/printed.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr std::array<const char*, 2> kLinks = {"pvs", "10gbit"};
constexpr std::array<int, 4> kTeamSizes = {1, 2, 5, 10};  // in addition to all workers

std::vector<int> Sizes(const PaperSetup& setup) {
  const std::set<int> sizes = {setup.table_size(), setup.large_size()};
  return {sizes.begin(), sizes.end()};
}

std::vector<int> Workers(const PaperSetup& setup) {
  std::vector<int> workers = setup.workers();
  std::erase_if(workers, [](int p) { return p != 1 && p % 10 != 0; });
  return workers;
}

FrameCase With(FrameCase frame, const Policy& policy) {
  frame.policy = policy;
  return frame;
}

// Seconds of one frame if nobody asks for the next before it is there.
double AloneSeconds(const MeasuredFrame& frame, const MachineModel& machine) { return Simulate(frame, machine).frames.front().latency(); }

// One way to render frames with p workers, and its result.
struct Outcome {
  std::string policy;
  int team = 1;        // workers that share a frame
  double seconds = 0;  // from picture to picture
  double alone = 0;    // of one frame
  double render = 0;   // sum over its boxes
  double most = 0;     // of the worker with the most
};

// The partitions to try with dynamic balance, too: measuring it takes one frame after the other.
std::vector<NamedPolicy> BalancedPartitions(int workers) {
  if (workers == 1) return {};
  std::vector<NamedPolicy> partitions = PartitionsAlongTheView();
  partitions.insert(partitions.begin(), {EqualSlabs(), BalancedTree()});
  for (NamedPolicy& named : partitions) {
    named.name += ", dynamic";
    named.policy.balance = kDynamicBalance;
  }
  return partitions;
}

std::vector<NamedPolicy> Partitions() {
  std::vector<NamedPolicy> partitions = AllPartitions();
  const std::vector<NamedPolicy> along = PartitionsAlongTheView();
  partitions.insert(partitions.end(), along.begin(), along.end());
  return partitions;
}

// Frames of one pipeline and size on one machine, however they are divided.
class Improved {
 public:
  Improved(const PaperSetup& setup, const RendererKind* renderer, int size, std::string_view link)
      : setup_(setup),
        renderer_(renderer),
        size_(size),
        paper_(link == "pvs"),
        machine_(paper_ ? setup.Machine(renderer) : Cluster(setup.context(), Link(link))) {}

  // The best of all partitions and the schemes that suit a link, with `team` of `workers` on a frame.
  Outcome FindBest(int workers, int team) const {
    Outcome best;
    for (const NamedPolicy& named : Partitions()) {
      Try(Recall(setup_.context(), With(setup_.Frame(renderer_, size_, team), named.policy)), named.name, workers, best);
    }
    for (const NamedPolicy& named : BalancedPartitions(team)) {
      // The median repeat, so that the luckiest does not count.
      std::vector<Outcome> outcomes;
      for (const MeasuredFrame& repeat : RecallBalanced(setup_.context(), With(setup_.Frame(renderer_, size_, team), named.policy))) {
        Try(repeat, named.name, workers, outcomes.emplace_back());
      }
      std::ranges::sort(outcomes, {}, &Outcome::seconds);
      const Outcome& middle = outcomes[outcomes.size() / 2];
      if (middle.seconds < best.seconds) best = middle;
    }
    return best;
  }

  // Equal slabs, one frame after the other, as measured in the paper: on its machine images are whole.
  double PlainSeconds(int workers) const {
    MeasuredFrame measured = Recall(setup_.context(), setup_.Frame(renderer_, size_, workers));
    Count(measured);
    if (paper_) FillImages(measured);
    return AloneSeconds(measured, machine_);
  }

 private:
  // The paper's times end with the combined image.
  void Count(MeasuredFrame& frame) const {
    if (paper_) frame.finish_seconds = frame.receive_seconds = 0;
  }

  void Try(MeasuredFrame frame, const std::string& name, int workers, Outcome& best) const {
    Count(frame);
    for (const std::string& scheme : UsualSchemes()) {
      frame.plan.combine = scheme;
      const double seconds = SteadySeconds(frame, machine_, workers / int(frame.plan.slots));
      if (!best.policy.empty() && seconds >= best.seconds) continue;
      best = {.policy = frame.plan.slots > 1 ? fmt::format("{}, {}", name, scheme) : "whole frames",
              .team = int(frame.plan.slots),
              .seconds = seconds,
              .alone = AloneSeconds(frame, machine_),
              .render = frame.RenderSeconds(),
              .most = std::ranges::max(frame.WorkerSeconds())};
    }
  }

  const PaperSetup& setup_;
  const RendererKind* renderer_;
  int size_;
  bool paper_;  // the paper's machine with the costs that it counts; else a cluster of today with all costs
  MachineModel machine_;
};

// Sizes of teams for p workers, the smallest first.
std::vector<int> TeamSizes(int workers) {
  std::vector<int> sizes;
  for (const int team : kTeamSizes) {
    if (team < workers && workers % team == 0) sizes.push_back(team);
  }
  sizes.push_back(workers);
  return sizes;
}

}  // namespace

std::vector<Trial> ImprovedTrials(const PaperSetup& setup) {
  std::set<int> shared;  // workers that share a frame
  for (const int p : Workers(setup)) {
    for (const int team : TeamSizes(p)) shared.insert(team);
  }
  std::vector<Trial> trials;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const int size : Sizes(setup)) {
      for (const int p : shared) {
        const FrameCase frame = setup.Frame(renderer, size, p);
        for (const NamedPolicy& named : Partitions()) trials.push_back(CostTrial(setup.context(), With(frame, named.policy)));
        for (const NamedPolicy& named : BalancedPartitions(p)) trials.push_back(CostTrial(setup.context(), With(frame, named.policy)));
      }
    }
  }
  return trials;
}

Section ImprovedSection(const PaperSetup& setup) {
  Table table{
      "streaming-and-balance",
      "Efficiency with streaming and balance",
      {"pipeline", "N", "link", "p", "workers a frame", "one frame at a time (%)", "streaming and balanced (%)", "no schedule exceeds (%)",
       "work of all boxes / of the whole", "longest / mean", "best policy", "picture to picture (ms)", "one frame (ms)", "volumes held"},
      {}};
  Section section;
  std::string plainly, printed_efficiency, everybody, teams;
  const int most_workers = Workers(setup).back();
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    const bool splat = renderer == Splatting();
    LineChart chart{fmt::format("{}: efficiency with streaming and balance", splat ? "Splatting" : "Z-buffer"),
                    {"workers p", ""},
                    {"efficiency", "%", AxisScale::kLinear, true},
                    {}};
    LineChart by_team{
        fmt::format("{}, p = {}: efficiency by how many workers share a frame", splat ? "Splatting" : "Z-buffer", most_workers),
        {"workers a frame", "", AxisScale::kLog},
        {"efficiency", "%", AxisScale::kLinear, true},
        {}};
    for (const int size : Sizes(setup)) {
      for (const char* link : kLinks) {
        const std::string name = fmt::format("N = {}, {}", size, link);
        LineSeries series{name, Origin::kSimulated, {}};
        LineSeries team_series = series;
        const Improved improved(setup, renderer, size, link);
        const Outcome one = improved.FindBest(1, 1);
        const double plain_one = improved.PlainSeconds(1);
        for (const int p : Workers(setup)) {
          const double plain = improved.PlainSeconds(p);
          for (const int team : TeamSizes(p)) {
            const int team_count = p / team;
            const Outcome best = improved.FindBest(p, team);
            const double efficiency = 100 * one.seconds / best.seconds / p, limit = 100 * one.render / team / best.most;
            table.rows.push_back({std::string(renderer->title()), Chosen(size), link, Chosen(p), Chosen(team),
                                  team == p ? Simulated(100 * plain_one / plain / p) : Cell(), Simulated(efficiency), Measured(limit),
                                  Measured(best.render / one.render), Measured(best.most * team / best.render), best.policy,
                                  Simulated(best.seconds * 1e3), Simulated(best.alone * 1e3), Chosen(team_count)});
            if (team == p) series.points.push_back({double(p), efficiency});
            if (p != most_workers) continue;
            team_series.points.push_back({double(team), efficiency});
            if (size != setup.table_size()) continue;
            if (team == p) {
              plainly +=
                  fmt::format("{}{} {:.0f} % ({})", plainly.empty() ? "" : ", ", renderer->title(), 100 * plain_one / plain / p, link);
              everybody +=
                  fmt::format("{}{} {:.0f} % ({}; boxes take {:.2f} times as long as the whole, the longest {:.2f} times the mean)",
                              everybody.empty() ? "" : ", ", renderer->title(), efficiency, link, best.render / one.render,
                              best.most * team / best.render);
            } else if (team <= 2) {
              teams += fmt::format("{}{} {:.0f} % (teams of {}, {})", teams.empty() ? "" : ", ", renderer->title(), efficiency, team, link);
            }
          }
        }
        chart.series.push_back(std::move(series));
        by_team.series.push_back(std::move(team_series));
      }
    }
    const auto& times = splat ? printed::kSplattingSeconds : printed::kZBufferSeconds;
    printed_efficiency += fmt::format("{}{} {:.0f} %", printed_efficiency.empty() ? "" : ", ", renderer->title(),
                                      100 * times.front() / times.back() / printed::kStageWorkers.back());
    section.blocks.emplace_back(Figure{fmt::format("improved-{}", splat ? "splatting" : "zbuffer"), DrawLines(chart),
                                       "Time from picture to picture of one worker, divided by p times that of p workers that share every "
                                       "frame."});
    section.blocks.emplace_back(Figure{fmt::format("teams-{}", splat ? "splatting" : "zbuffer"), DrawLines(by_team),
                                       "Teams take frames in turn. The fewer workers share a frame, the more of the volume each of them "
                                       "holds."});
  }
  section.blocks.emplace_back(std::move(table));

  // The timeline of a few frames.
  const int p = Workers(setup)[std::min<std::size_t>(1, Workers(setup).size() - 1)];
  const FrameCase shown = setup.Frame(Splatting(), setup.large_size(), p);
  const MeasuredFrame slabs = Recall(setup.context(), shown);
  const NamedPolicy balanced = BalancedTree();
  const MeasuredFrame even = Recall(setup.context(), With(shown, balanced.policy));
  for (const auto& [name, frame] : {std::pair{std::string("equal slabs"), &slabs}, {balanced.name, &even}}) {
    const Timeline timeline = Simulate(*frame, Cluster(setup.context(), Link("10gbit")), 6, 4, true);
    section.blocks.emplace_back(
        TimelineFigure("timeline-" + Slug(name), fmt::format("Three frames on {} workers: {}", p, name), timeline,
                       timeline.frames[1].received, timeline.frames[4].received,
                       "What each worker's two threads do, and when pixels arrive at it; 10 Gbit/s switched, frames asked for ahead."));
    section.blocks.emplace_back(BoxCostFigure("box-costs-" + Slug(name), fmt::format("Render time by box on {} workers: {}", p, name),
                                              *frame, "Every box rendered alone, on one thread."));
  }

  section.title = "Beyond the paper: streaming and balance";
  section.question = "The paper proposes data streaming, other primitives and load balancing. What do they give?";
  section.method =
      "The same spheres, now with as many frames asked for ahead as keep all workers busy: they render the next frames while the last ones "
      "are combined, and take turns at making the picture. Volumes are divided so that workers have equal work: every partition along z, "
      "slabs and kd-trees also along the axis on which the view's slices are traversed, four of them with dynamic balance, too, and the "
      "usual combining schemes are tried; the best one is shown and named. Efficiency compares the "
      "time from picture to picture with that of one worker on the same machine. No schedule exceeds what the boxes allow: the whole "
      "volume's render time over that of the worker that has most, times the workers a frame. Where not all workers share every frame, "
      "teams of them take frames in turn, and each team holds the volume. pvs is the paper's bus scaled to these processors, one a "
      "worker, without what a service does around a frame; 10gbit a switched network with all of it, two cores a worker; the way of the "
      "pictures to the client is on neither.";
  section.answer = fmt::format(
      "At N = {} and p = {}. One frame at a time in equal slabs, efficiency by latency: {} (the paper at N = {}, p = {}: {}). "
      "Frames asked for ahead, efficiency by throughput, all workers on every frame: {}; in teams: {}.",
      setup.table_size(), most_workers, plainly, printed::kSize, printed::kStageWorkers.back(), printed_efficiency, everybody, teams);
  return section;
}

}  // namespace slabstream

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/planning/assignment.h"
#include "common/planning/balance.h"
#include "common/planning/policy_names.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/moving_view.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/measure/box_costs.h"
#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 3, kQuickRepeats = 1;
constexpr int kTableWorkers = 16;  // p of the tables that compare partitions
constexpr int kBoxesAWorker = 4;   // to compare assignments: with one box each they have no choice
constexpr std::string_view kLink = "10gbit";

struct Balance {
  std::vector<BenchCase> volumes;
  std::vector<int> workers;
  int pixels = 512;
  FrameCase Frame(const BenchCase& volume, const Policy& policy, int p) const {
    return {volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), policy, p};
  }
};

Balance BalanceOf(const ExperimentContext& context) {
  Balance balance;
  const int size = context.Scaled(context.quick() ? 128 : 300);
  balance.volumes = {StandardSphere(SphereClass::kHollow, size), SphereCase({SphereClass::kFilled, size, 0.1}, kTranslucentSphere)};
  const std::vector<BenchCase> real = RealVolumes(context.options().volumes);
  if (!context.quick() || !context.options().volumes.empty()) balance.volumes.insert(balance.volumes.end(), real.begin(), real.end());
  balance.workers = context.quick() ? std::vector{2, 16, 64} : std::vector{2, 4, 8, 16, 32, 64, 128, 256, 512, 1024};
  balance.pixels = context.Scaled(512);
  return balance;
}

Policy WithBoxes(Policy policy, std::string_view assignment) {
  policy.groups = kBoxesAWorker;
  policy.assignment = assignment;
  return policy;
}

std::vector<NamedPolicy> MovingPolicies() {
  std::vector<NamedPolicy> policies;
  for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
    for (const NamedChoice& balance : BalanceModes()) {
      policies.push_back({fmt::format("{}, {}", named.name, balance.name), named.policy});
      policies.back().policy.balance = balance.name;
    }
  }
  return policies;
}

FrameCase MovingFrame(const Balance& balance, const BenchCase& volume, const NamedPolicy& moving) {
  FrameCase first = balance.Frame(volume, moving.policy, kTableWorkers);
  first.view = BenchView(Projection::kOrthographic, 0, kMovingFrames);
  return first;
}

int MovingFrames(const ExperimentContext& context) { return context.quick() ? 6 : kMovingFrames; }

std::vector<Trial> TrialsOf(ExperimentContext& context, const Balance& balance) {
  std::vector<Trial> trials = {HostTrial()};
  for (const BenchCase& volume : balance.volumes) {
    for (const NamedPolicy& named : AllPartitions()) {
      trials.push_back(FinishTrial(context, balance.Frame(volume, named.policy, 1)));
      for (const int p : balance.workers) trials.push_back(BoxCostTrial(context, balance.Frame(volume, named.policy, p)));
      trials.push_back(BoxCostTrial(context, balance.Frame(volume, named.policy, kTableWorkers)));
      for (const AssignmentEntry& assignment : Assignments()) {
        trials.push_back(BoxCostTrial(context, balance.Frame(volume, WithBoxes(named.policy, assignment.name), kTableWorkers)));
      }
    }
    for (const NamedPolicy& moving : MovingPolicies()) {
      trials.push_back(MovingTrial(context, MovingFrame(balance, volume, moving), MovingFrames(context)));
    }
  }
  return trials;
}

Table NewTable(const std::string& name, const std::string& title) {
  return {
      name,
      title,
      {"policy", "p", "boxes", "imbalance", "idle (%)", "frame (ms)", "picture to picture (ms)", "image bytes (MB)", "voxels to send (MB)"},
      {}};
}

struct Outcome {
  FrameFigures figures;
  double imbalance = 1;
};

Outcome AddRow(ExperimentContext& context, const FrameCase& frame, const std::string& name, Table& table) {
  const MeasuredFrame measured = Recall(context, frame);
  const FrameFigures figures = FindFigures(measured, Cluster(context, Link(kLink)));
  double boxes = 0, bytes = 0;
  for (const MeasuredFrame::Cost& box : measured.boxes) {
    boxes += box.seconds > 0 ? 1 : 0;
    bytes += box.voxel_bytes;
  }
  const Outcome outcome{figures, Imbalance(measured.WorkerSeconds())};
  table.rows.push_back({name, Chosen(frame.workers), Chosen(boxes), Measured(outcome.imbalance), Simulated(figures.idle_share * 100),
                        Simulated(figures.latency_seconds * 1e3), Simulated(figures.steady_seconds * 1e3),
                        Simulated(figures.image_bytes * 1e-6), Measured(bytes * 1e-6)});
  return outcome;
}

// "boxes of equal ..."
std::string SplitWords(const std::string& split) { return split == "occupied" ? "occupied voxels" : split; }

// Partitions over workers.
Section PartitionSection(ExperimentContext& context, const Balance& balance, const BenchCase& volume) {
  const std::string title = TitleOf(volume);
  Table table = NewTable("partitions-" + volume.dataset, fmt::format("{}: one box a worker", title));
  // One chart for each split: a chart with more lines than the palette has colours would be unreadable.
  std::map<std::string, LineChart> imbalance, times;
  std::map<std::string, double> at_table;
  for (const NamedPolicy& named : AllPartitions()) {
    const std::string& split = named.policy.load_metric;
    LineSeries even{named.policy.decomposition, Origin::kMeasured, {}}, time{named.policy.decomposition, Origin::kSimulated, {}};
    for (const int p : balance.workers) {
      const Outcome outcome = AddRow(context, balance.Frame(volume, named.policy, p), named.name, table);
      even.points.push_back({double(p), outcome.imbalance});
      time.points.push_back({double(p), outcome.figures.steady_seconds * 1e3});
      if (p == kTableWorkers) at_table[named.name] = outcome.imbalance;
    }
    const AxisSpec workers = WorkersAxis();
    imbalance.try_emplace(
        split,
        LineChart{
            fmt::format("{}: imbalance, boxes of equal {}", title, SplitWords(split)), workers, {"most / mean", "", AxisScale::kLog}, {}});
    times.try_emplace(split, LineChart{fmt::format("{}: picture to picture, boxes of equal {}", title, SplitWords(split)),
                                       workers,
                                       {"time", "ms", AxisScale::kLog},
                                       {}});
    imbalance.at(split).series.push_back(std::move(even));
    times.at(split).series.push_back(std::move(time));
  }
  const auto best = std::ranges::min_element(at_table, {}, [](const auto& entry) { return entry.second; });
  Section section;
  section.title = "Partitions: " + title;
  section.question = "Which partition gives workers equal work?";
  section.method = fmt::format(
      "{0} x {0} pixels, one box a worker. Every box is rendered alone on one thread; imbalance is the longest of the workers' render "
      "times over their mean. "
      "Frames are simulated on a switched network of 10 Gbit/s with all that a service does around a frame.",
      balance.pixels);
  section.answer =
      fmt::format("At p = {} equal slabs have an imbalance of {:.2f}, the kd-tree by occupied voxels {:.2f}; the best is {} with {:.2f}.",
                  kTableWorkers, at_table[EqualSlabs().name], at_table[BalancedTree().name], best->first, best->second);
  for (const auto& [split, chart] : imbalance) {
    section.blocks.emplace_back(Figure{fmt::format("imbalance-{}-{}", volume.dataset, split), DrawLines(chart),
                                       "Render times of workers; 1 is perfect. Workers whose box shows nothing count with no time."});
  }
  for (const auto& [split, chart] : times) {
    section.blocks.emplace_back(Figure{fmt::format("time-{}-{}", volume.dataset, split), DrawLines(chart),
                                       "As many frames asked for ahead as keep all workers busy."});
  }
  for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
    const MeasuredFrame measured = Recall(context, balance.Frame(volume, named.policy, kTableWorkers));
    section.blocks.emplace_back(BoxCostFigure(fmt::format("boxes-{}-{}", volume.dataset, Slug(named.name)),
                                              fmt::format("{}, p = {}: {}", title, kTableWorkers, named.name), measured,
                                              "Render time of every box that the cut meets."));
  }
  section.blocks.emplace_back(std::move(table));
  return section;
}

// Assignments, where workers have several boxes.
Section AssignmentSection(ExperimentContext& context, const Balance& balance) {
  Section section;
  section.title = "Assignments";
  section.question = fmt::format("With {} boxes a worker, who should own which?", kBoxesAWorker);
  section.method = fmt::format(
      "p = {}, {} groups. greedy gives the costliest box that is left to the worker that has least, by occupied voxels; what boxes really "
      "take is measured.",
      kTableWorkers, kBoxesAWorker);
  std::string sentence;
  for (const BenchCase& volume : balance.volumes) {
    Table table = NewTable("assignments-" + volume.dataset, fmt::format("{}: {} boxes a worker", TitleOf(volume), kBoxesAWorker));
    BarChart chart{TitleOf(volume) + ": imbalance by assignment", "partition", {"most / mean", ""}, {}, {}};
    std::pair<double, std::string> best{std::numeric_limits<double>::infinity(), ""};
    for (const NamedPolicy& named : AllPartitions()) {
      BarGroup group{named.name, {}};
      for (const AssignmentEntry& assignment : Assignments()) {
        const std::string name = fmt::format("{}, {}", named.name, assignment.name);
        const Outcome outcome =
            AddRow(context, balance.Frame(volume, WithBoxes(named.policy, assignment.name), kTableWorkers), name, table);
        group.bars.push_back({std::string(assignment.name), Origin::kMeasured, {outcome.imbalance}});
        best = std::min(best, {outcome.imbalance, name});
      }
      chart.groups.push_back(std::move(group));
    }
    sentence += fmt::format("{}{}: {} ({:.2f})", sentence.empty() ? "" : "; ", TitleOf(volume), best.second, best.first);
    section.blocks.emplace_back(Figure{"assignments-" + volume.dataset, DrawBars(chart), "1 is perfect."});
    section.blocks.emplace_back(std::move(table));
  }
  section.answer = "Most even, " + sentence + ".";
  return section;
}

// A moving view, static and dynamic.
Section MovingSection(ExperimentContext& context, const Balance& balance) {
  Section section;
  section.title = "Static and dynamic balance under a moving view";
  section.question = "Does learning from earlier frames keep workers even while the view turns, and what does it move?";
  section.method = fmt::format(
      "p = {}, a turn of {} frames, of which {} are rendered box by box. dynamic: what boxes took is learnt, and boxes are cut anew or "
      "handed over between frames where the coordinator finds that it pays; the voxels that then change owner are counted.",
      kTableWorkers, kMovingFrames, MovingFrames(context));
  Table table{"moving-view", "A moving view", {"volume", "policy", "frame", "imbalance", "slowest worker (ms)", "voxels moved (MB)"}, {}};
  std::string sentence;
  for (const BenchCase& volume : balance.volumes) {
    LineChart chart{TitleOf(volume) + ": imbalance, frame by frame", {"frame", ""}, {"most / mean", ""}, {}};
    for (const NamedPolicy& moving : MovingPolicies()) {
      const Json key = MovingKey(context, MovingFrame(balance, volume, moving), MovingFrames(context));
      const std::vector<const Json*> repeats = context.log().All(key);
      const std::vector<Estimate> imbalance = EstimatesOf(repeats, "imbalance"), slowest = EstimatesOf(repeats, "slowest_ms");
      const std::vector<double> moved = MediansOf(repeats, "moved_bytes");
      LineSeries series{moving.name, Origin::kMeasured, {}};
      for (std::size_t i = 0; i < imbalance.size(); ++i) {
        series.points.push_back({double(i + 1), imbalance[i].median, imbalance[i].low, imbalance[i].high});
        table.rows.push_back(
            {TitleOf(volume), moving.name, Chosen(double(i + 1)), Measured(imbalance[i]), Measured(slowest[i]), Measured(moved[i] * 1e-6)});
      }
      chart.series.push_back(std::move(series));
      if (moving.name != "kd-tree by occupied, dynamic") continue;
      const std::size_t sixth = std::min<std::size_t>(5, imbalance.size() - 1);
      sentence += fmt::format("{}{} {:.2f} after {} frames, {:.1f} MB moved in all", sentence.empty() ? "" : "; ", TitleOf(volume),
                              imbalance[sixth].median, sixth, std::accumulate(moved.begin(), moved.end(), 0.0) * 1e-6);
    }
    section.blocks.emplace_back(Figure{"moving-" + volume.dataset, DrawLines(chart), "Medians over repeats, frame by frame."});
  }
  section.answer = "The kd-tree with dynamic balance: " + sentence + ".";
  section.blocks.emplace_back(std::move(table));
  return section;
}

}  // namespace

Report RunBalance(ExperimentContext& context) {
  const Balance balance = BalanceOf(context);
  context.Run(TrialsOf(context, balance), kRepeats, kQuickRepeats);
  Report report;
  report.title = "Balance: partitions, assignments and learning";
  report.summary =
      "Sparse volumes give equal slabs very unequal work. Every partition, divided by voxels and by occupied voxels, every assignment, and "
      "boxes that change while the view moves: who is idle, what travels, how long a frame takes.";
  for (const BenchCase& volume : balance.volumes) {
    report.sections.push_back(PartitionSection(context, balance, volume));
  }
  report.sections.push_back(AssignmentSection(context, balance));
  report.sections.push_back(MovingSection(context, balance));
  return report;
}

}  // namespace slabstream

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/report/charts.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 3, kQuickRepeats = 1;
constexpr std::string_view kLink = "10gbit";
constexpr int kTeam = 2;                 // workers that share a frame, in series with teams
constexpr int kMostDynamicWorkers = 64;  // measuring more boxes frame after frame takes long

FrameCase FrameOf(const BenchCase& volume, int pixels, const Policy& policy, int workers) {
  return {volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), policy, workers};
}

// One line of the report: the same policy for different numbers of workers. The volume may grow with them.
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
  for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
    for (const std::string& scheme : UsualSchemes()) {
      Series series{fmt::format("{}, {}", named.name, scheme), {}};
      Policy policy = named.policy;
      policy.combine = scheme;
      for (const int p : workers) series.frames.push_back(FrameOf(sphere, pixels, policy, p));
      all.push_back(std::move(series));
    }
  }
  Series dynamic{"slabs, dynamic balance", {}}, teams{fmt::format("slabs, teams of {}", kTeam), {}, kTeam};
  Policy balanced = EqualSlabs().policy;
  balanced.balance = kDynamicBalance;
  for (const int p : workers) {
    if (p <= kMostDynamicWorkers) dynamic.frames.push_back(FrameOf(sphere, pixels, balanced, p));
    teams.frames.push_back(FrameOf(sphere, pixels, EqualSlabs().policy, p));
  }
  all.insert(all.end(), {std::move(dynamic), std::move(teams)});
  return all;
}

// Equally many voxels for each worker, whatever their number.
std::vector<Series> WeakSeries(const ExperimentContext& context) {
  const std::vector<int> workers = context.quick() ? std::vector{1, 8} : std::vector{1, 2, 4, 8, 16, 32, 64};
  const int one = context.Scaled(context.quick() ? 48 : 96), pixels = context.Scaled(512);
  std::vector<Series> all;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
      Series series{fmt::format("{}, {}", renderer->title(), named.name), {}};
      for (const int p : workers) {
        const int size = int(std::lround(one * std::cbrt(double(p))));
        series.frames.push_back(FrameOf(StandardSphere(SphereClass::kFilled, size, renderer), pixels, named.policy, p));
      }
      all.push_back(std::move(series));
    }
  }
  return all;
}

// A section of the report.
struct Kind {
  std::string slug, title;
  bool weak = false;
  std::vector<Series> series;
};

std::vector<Kind> KindsOf(const ExperimentContext& context) {
  return {{"strong-splatting", "Strong scaling: splatting", false, StrongSeries(context, Splatting())},
          {"strong-zbuffer", "Strong scaling: Z-buffer", false, StrongSeries(context, ZBuffer())},
          {"weak", "Weak scaling", true, WeakSeries(context)}};
}

// Efficiency by the time from picture to picture. The ideal time is one / p for strong scaling, one for weak scaling.
Section SectionOf(ExperimentContext& context, const Kind& kind) {
  Table table{kind.slug,
              kind.title,
              {"series", "p", "volume", "frame (ms)", "picture to picture (ms)", "efficiency (%)", "imbalance", "idle (%)"},
              {}};
  LineChart times{
      kind.weak ? "Picture to picture, as many voxels a worker" : "Picture to picture", WorkersAxis(), {"time", "ms", AxisScale::kLog}, {}};
  LineChart efficiencies{kind.weak ? "Efficiency of weak scaling" : "Efficiency of strong scaling",
                         WorkersAxis(),
                         {"efficiency", "%", AxisScale::kLinear, true},
                         {}};
  const MachineModel machine = Cluster(context, Link(kLink));
  std::string sentence;
  for (const Series& series : kind.series) {
    LineSeries time{series.name, Origin::kSimulated, {}};
    LineSeries efficiency = time;
    double one = 0;
    for (const FrameCase& frame : series.frames) {
      const FrameFigures figures =
          RecallFigures(context, series.Shared(frame), machine, &FrameFigures::steady_seconds, frame.workers / series.TeamOf(frame));
      if (frame.workers == 1) one = figures.steady_seconds;
      const double percent = 100 * one / figures.steady_seconds / (kind.weak ? 1 : frame.workers);
      time.points.push_back({double(frame.workers), figures.steady_seconds * 1e3});
      efficiency.points.push_back({double(frame.workers), percent});
      table.rows.push_back({series.name, Chosen(frame.workers), frame.volume.dataset, Simulated(figures.latency_seconds * 1e3),
                            Simulated(figures.steady_seconds * 1e3), Simulated(percent), Simulated(figures.imbalance),
                            Simulated(figures.idle_share * 100)});
    }
    const auto half = std::ranges::find_if(efficiency.points, [](const LinePoint& point) { return point.y < 50; });
    sentence += fmt::format("{}{}: {}", sentence.empty() ? "" : "; ", series.name,
                            half == efficiency.points.end() ? fmt::format("above 50 % up to p = {:.0f}", efficiency.points.back().x)
                                                            : fmt::format("below 50 % from p = {:.0f} on", half->x));
    times.series.push_back(std::move(time));
    efficiencies.series.push_back(std::move(efficiency));
  }
  Section section;
  section.title = kind.title;
  section.question = kind.weak ? "Ever more voxels for ever more workers, as many for each: does a frame take as long?"
                               : "The same volume for ever more workers: how much faster?";
  section.method = fmt::format(
      "Boxes are rendered alone, each on one thread; frames are simulated on a network ({}) with all that a service does around a frame, "
      "as many frames asked for ahead as keep all workers busy. {}",
      kLink,
      kind.weak ? "Class-II spheres, 40 % occupied."
                : fmt::format(
                      "A class-I sphere, 5 % occupied. Balance is static where a series does not say otherwise; teams of {} take frames in "
                      "turn, each with all voxels; else all workers share every frame.",
                      kTeam));
  section.answer = "Efficiency, " + sentence + ".";
  section.blocks = {Figure{kind.slug + "-time", DrawLines(times), "Both axes logarithmic."},
                    Figure{kind.slug + "-efficiency", DrawLines(efficiencies), "Against one worker of the same series."}, std::move(table)};
  return section;
}

}  // namespace

Report RunScaling(ExperimentContext& context) {
  const std::vector<Kind> kinds = KindsOf(context);
  std::vector<Trial> trials = {HostTrial()};
  for (const Kind& kind : kinds) {
    for (const Series& series : kind.series) {
      for (const FrameCase& frame : series.frames) {
        const FrameCase shared = series.Shared(frame);
        trials.push_back(CostTrial(context, shared));
        trials.push_back(FinishTrial(context, shared));
      }
    }
  }
  context.Run(std::move(trials), kRepeats, kQuickRepeats);
  Report report;
  report.title = "Strong and weak scaling";
  report.summary = "How far more workers help, with one volume for all of them and with as much volume for each.";
  for (const Kind& kind : kinds) {
    report.sections.push_back(SectionOf(context, kind));
  }
  return report;
}

}  // namespace slabstream

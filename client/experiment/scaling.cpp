#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/experiment/experiment.h"
#include "client/experiment/figures.h"
#include "client/experiment/machines.h"
#include "client/experiment/policies.h"
#include "client/experiment/report/charts.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 3, kQuickRepeats = 1;
constexpr std::string_view kLink = "10gbit";

FrameCase FrameOf(const BenchCase& volume, int pixels, const Policy& policy, int workers) {
  return {volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), policy, workers};
}

// One line of the report: the same policy over workers. The volume may grow with them.
struct Series {
  std::string name;
  std::vector<FrameCase> frames;  // by workers, 1 first
};

std::vector<Series> StrongSeries(const ExperimentContext& context) {
  const std::vector<int> workers = context.quick() ? std::vector{1, 4, 16, 64} : std::vector{1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024};
  const int size = context.Scaled(context.quick() ? 128 : 300), pixels = context.Scaled(512);
  std::vector<Series> all;
  for (const RendererKind renderer : {RendererKind::kSplat, RendererKind::kZBuffer}) {
    const BenchCase sphere =
        SphereCase({SphereClass::kHollow, size, 0.05}, renderer == RendererKind::kSplat ? kTranslucentSphere : kOpaqueSphere, renderer);
    for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
      for (const std::string& scheme : UsualSchemes()) {
        Series series{fmt::format("{}, {}, {}", NameOf(renderer), named.name, scheme), {}};
        Policy policy = named.policy;
        policy.combine = scheme;
        for (const int p : workers) series.frames.push_back(FrameOf(sphere, pixels, policy, p));
        if (std::ranges::find(all, series.name, &Series::name) == all.end()) all.push_back(std::move(series));
      }
    }
  }
  return all;
}

// As many voxels for each worker, whatever their number.
std::vector<Series> WeakSeries(const ExperimentContext& context) {
  const std::vector<int> workers = context.quick() ? std::vector{1, 8} : std::vector{1, 2, 4, 8, 16, 32, 64};
  const int one = context.Scaled(context.quick() ? 48 : 96), pixels = context.Scaled(512);
  std::vector<Series> all;
  for (const RendererKind renderer : {RendererKind::kSplat, RendererKind::kZBuffer}) {
    for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
      Series series{fmt::format("{}, {}", NameOf(renderer), named.name), {}};
      for (const int p : workers) {
        const int size = int(std::lround(one * std::cbrt(double(p))));
        const BenchCase sphere =
            SphereCase({SphereClass::kFilled, size, 0.4}, renderer == RendererKind::kSplat ? kTranslucentSphere : kOpaqueSphere, renderer);
        series.frames.push_back(FrameOf(sphere, pixels, named.policy, p));
      }
      if (std::ranges::find(all, series.name, &Series::name) == all.end()) all.push_back(std::move(series));
    }
  }
  return all;
}

// Efficiency by the time from picture to picture: of strong scaling one / p, of weak scaling one.
Result<Section> SectionOf(ExperimentContext& context, const std::vector<Series>& all, bool weak) {
  const std::string kind = weak ? "weak" : "strong";
  Table table{kind,
              weak ? "Weak scaling" : "Strong scaling",
              {{"series", ""},
               {"p", ""},
               {"volume", ""},
               {"frame", "ms"},
               {"picture to picture", "ms"},
               {"efficiency", "%"},
               {"imbalance", ""},
               {"idle", "%"}},
              {}};
  LineChart times{weak ? "Picture to picture, as many voxels a worker" : "Picture to picture",
                  {"workers p", "", AxisScale::kLog},
                  {"time", "ms", AxisScale::kLog},
                  {}};
  LineChart efficiencies{weak ? "Efficiency of weak scaling" : "Efficiency of strong scaling",
                         {"workers p", "", AxisScale::kLog},
                         {"efficiency", "%", AxisScale::kLinear, true},
                         {}};
  const MachineModel machine = Cluster(context, Link(kLink));
  std::string sentence;
  for (const Series& series : all) {
    LineSeries time{series.name, Origin::kSimulated, {}}, efficiency = time;
    double one = 0;
    for (const FrameCase& frame : series.frames) {
      const Result<MeasuredFrame> measured = Recall(context, frame);
      if (!measured.ok()) return measured.status();
      const Result<FrameFigures> figures = FindFigures(*measured, machine);
      if (!figures.ok()) return figures.status();
      if (frame.workers == 1) one = figures->steady_seconds;
      const double percent = 100 * one / figures->steady_seconds / (weak ? 1 : frame.workers);
      time.points.push_back({double(frame.workers), figures->steady_seconds * 1e3});
      efficiency.points.push_back({double(frame.workers), percent});
      table.rows.push_back({series.name,
                            Cell::Parameter(frame.workers),
                            frame.volume.dataset,
                            {figures->latency_seconds * 1e3, Origin::kSimulated},
                            {figures->steady_seconds * 1e3, Origin::kSimulated},
                            {percent, Origin::kSimulated},
                            {figures->imbalance, Origin::kSimulated},
                            {figures->idle_share * 100, Origin::kSimulated}});
    }
    const auto half = std::ranges::find_if(efficiency.points, [](const LinePoint& point) { return point.y < 50; });
    sentence += fmt::format("{}{}: {}", sentence.empty() ? "" : "; ", series.name,
                            half == efficiency.points.end() ? fmt::format("above 50 % up to p = {:.0f}", efficiency.points.back().x)
                                                            : fmt::format("below 50 % from p = {:.0f} on", half->x));
    times.series.push_back(std::move(time));
    efficiencies.series.push_back(std::move(efficiency));
  }
  Section section;
  section.title = weak ? "Weak scaling" : "Strong scaling";
  section.question = weak ? "Ever more voxels for ever more workers, as many for each: does a frame take as long?"
                          : "The same volume for ever more workers: how much faster?";
  section.method = fmt::format(
      "Boxes are rendered alone, each on one thread; frames are simulated on a network ({}) with all that a service does around a frame, "
      "{} frames asked for ahead. {} One worker makes the picture of each frame: no number of workers takes less than that.",
      kLink, kFramesAhead, weak ? "Class-II spheres, 40 % occupied." : "A class-I sphere, 5 % occupied.");
  section.answer = "Efficiency, " + sentence + ".";
  section.blocks = {Figure{kind + "-time", DrawLines(times), "Both axes logarithmic."},
                    Figure{kind + "-efficiency", DrawLines(efficiencies), "Against one worker of the same series."}, std::move(table)};
  return section;
}

}  // namespace

Result<Report> RunScaling(ExperimentContext& context) {
  const std::vector<Series> strong = StrongSeries(context), weak = WeakSeries(context);
  std::vector<Trial> trials = {HostTrial(1)};
  for (const auto* all : {&strong, &weak}) {
    for (const Series& series : *all) {
      for (const FrameCase& frame : series.frames) {
        trials.push_back(BoxCostTrial(context, frame));
        trials.push_back(FinishTrial(context, frame));
      }
    }
  }
  if (Status status = context.Run(WithoutDoubles(std::move(trials)), context.quick() ? kQuickRepeats : kRepeats); !status.ok())
    return status;
  Report report;
  report.title = "Strong and weak scaling";
  report.summary = "How far more workers help, with one volume for all of them and with as much volume for each.";
  for (const bool is_weak : {false, true}) {
    Result<Section> section = SectionOf(context, is_weak ? weak : strong, is_weak);
    if (!section.ok()) return section.status();
    report.sections.push_back(*std::move(section));
  }
  return report;
}

}  // namespace slabstream

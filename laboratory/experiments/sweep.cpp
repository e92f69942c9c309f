#include <fmt/format.h>

#include <algorithm>

#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/plots.h"
#include "laboratory/experiments/sweep_file.h"
#include "laboratory/report/charts.h"
#include "laboratory/report/text.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 3, kQuickRepeats = 1, kServiceFrames = 5, kMeasuredWorkers = 2;

FrameCase FrameOf(ExperimentContext& context, const Sweep& sweep, const BenchCase& volume, const RendererKind* renderer,
                  const SweepView& view, const SweepPolicy& policy, int workers, const SweepLink& link) {
  FrameCase frame{volume, sweep.size, view.view, policy.policy, workers};
  frame.volume.renderer = renderer;
  return WithChosenPolicy(context, std::move(frame), link.link);
}

// The policy's name in the table.
std::string PolicyText(const SweepPolicy& asked, const Policy& chosen) {
  return LeavesChoice(asked.policy) ? fmt::format("{}: {}", asked.name, Describe(chosen)) : asked.name;
}

template <class Use>
void ForEachPicture(const Sweep& sweep, Use&& use) {
  for (const BenchCase& volume : sweep.volumes) {
    for (const RendererKind* renderer : sweep.renderers) {
      for (const SweepView& view : sweep.views) {
        use(volume, renderer, view);
      }
    }
  }
}

std::vector<Trial> TrialsOf(ExperimentContext& context, const Sweep& sweep) {
  std::vector<Trial> trials = {HostTrial()};
  ForEachPicture(sweep, [&](const BenchCase& volume, const RendererKind* renderer, const SweepView& view) {
    for (const SweepPolicy& policy : sweep.policies) {
      for (const int p : sweep.workers) {
        for (const SweepLink& link : sweep.links) {
          const FrameCase frame = FrameOf(context, sweep, volume, renderer, view, policy, p, link);
          trials.push_back(CostTrial(context, frame));
          trials.push_back(FinishTrial(context, frame));
          if (p <= kMeasuredWorkers) trials.push_back(ServiceTrial(context, frame, kServiceFrames));
        }
      }
    }
  });
  return trials;
}

}  // namespace

void CheckSweepFile(const ExperimentOptions& options) { OrThrow(ReadSweep(options.sweep_file).status()); }

Report RunSweep(ExperimentContext& context) {
  const Sweep sweep = OrThrow(ReadSweep(context.options().sweep_file));
  context.Run(TrialsOf(context, sweep), kRepeats, kQuickRepeats);

  Report report;
  report.title = sweep.title;
  report.summary = fmt::format("A sweep of your own: {} volumes, {} renderers, {} views, {} policies, {} numbers of workers and {} links.",
                               sweep.volumes.size(), sweep.renderers.size(), sweep.views.size(), sweep.policies.size(),
                               sweep.workers.size(), sweep.links.size());
  ForEachPicture(sweep, [&](const BenchCase& volume, const RendererKind* renderer, const SweepView& view) {
    const std::string title = fmt::format("{}, {}, {}", volume.name, renderer->title(), view.name), name = Slug(title);
    Table table{name,
                title,
                {"policy", "p", "link", "frame (ms)", "picture to picture (ms)", "first preview (ms)", "imbalance", "idle (%)",
                 "image bytes (MB)", "service here (ms)"},
                {}};
    LineChart chart{title, WorkersAxis(), {"frame", "ms", AxisScale::kLog}, {}};
    std::pair<double, std::string> fastest{0, ""};
    for (const SweepPolicy& policy : sweep.policies) {
      for (const SweepLink& link : sweep.links) {
        LineSeries series{sweep.links.size() == 1 ? policy.name : fmt::format("{}, {}", policy.name, link.name), Origin::kSimulated, {}};
        LineSeries measured{series.name, Origin::kMeasured, {}};
        for (const int p : sweep.workers) {
          const FrameCase frame = FrameOf(context, sweep, volume, renderer, view, policy, p, link);
          const FrameFigures figures = RecallFigures(context, frame, Cluster(context, link.link), &FrameFigures::latency_seconds);
          const double ms = figures.latency_seconds * 1e3;
          Cell service;
          if (p <= kMeasuredWorkers) {
            const Estimate e = EstimateOf(context.log(), ServiceKey(context, frame, kServiceFrames), "latency_ms");
            service = Measured(e);
            measured.points.push_back({double(p), e.median, e.low, e.high});
          }
          series.points.push_back({double(p), ms});
          if (fastest.second.empty() || ms < fastest.first)
            fastest = {ms, fmt::format("{} on {} workers over {}", policy.name, p, link.name)};
          table.rows.push_back({PolicyText(policy, frame.policy), Chosen(p), link.name, Simulated(ms),
                                Simulated(figures.steady_seconds * 1e3), Simulated(figures.preview_seconds * 1e3),
                                Simulated(figures.imbalance), Simulated(figures.idle_share * 100), Simulated(figures.image_bytes * 1e-6),
                                service});
        }
        std::ranges::sort(series.points, {}, &LinePoint::x);
        std::ranges::sort(measured.points, {}, &LinePoint::x);
        chart.series.push_back(std::move(series));
        if (!measured.points.empty()) chart.series.push_back(std::move(measured));
      }
    }
    Section section;
    section.title = title;
    section.method =
        "Every box rendered alone on one thread; frames simulated from their costs; up to two workers also by the service in this process, "
        "whose workers share one machine. With dynamic balance boxes are those that some frames of the same view have led to.";
    section.answer = fmt::format("The fastest frame takes {} ms: {}.", FormatNumber(fastest.first), fastest.second);
    section.blocks = {Figure{name, DrawLines(chart), "Time of a frame that nobody asked for ahead."}, std::move(table)};
    report.sections.push_back(std::move(section));
  });
  return report;
}

}  // namespace slabstream

#include <algorithm>

#include "client/cli/option_groups.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/service_frames.h"
#include "laboratory/experiments/sweep_file.h"

namespace slabstream {
namespace {

constexpr int kMeasuredWorkers = 2;

// One value of everything that a sweep varies.
struct SweepCase {
  Json columns;
  LinkModel link;
  FrameCase frame;  // of all workers
  FrameCase team;   // of the workers of one team: what is measured box by box, and simulated
  int teams = 1;
  bool served = false;  // also measured with the service
};

std::vector<SweepCase> CasesOf(ExperimentContext& context, const Sweep& sweep) {
  std::vector<SweepCase> cases;
  for (const SweepFrame& asked : FramesOf(sweep)) {
    for (const int p : sweep.workers) {
      for (const SweepLink& link : sweep.links) {
        SweepCase& c = cases.emplace_back();
        c.link = link.link;
        c.teams = std::min(asked.frame.policy.teams, p);
        c.team = asked.frame;
        c.team.workers = p / c.teams;
        c.team.policy.teams = 1;
        c.frame = c.team;
        c.frame.workers = p;
        c.frame.policy.teams = asked.frame.policy.teams;
        // The service has no link to vary.
        c.served = p <= kMeasuredWorkers && link.name == sweep.links.front().name;
        c.columns = ColumnsOf(c.frame);
        c.columns.update(asked.names);
        c.columns.update(Json{{"teams", c.teams}, {"link", link.name}});
        if (c.team.policy.groups == 0) c.columns["groups"] = PlanOf(context, c.team).groups.size();
      }
    }
  }
  return cases;
}

// What the simulation is given, by the names that the same times have at a service.
void AddInputs(ExperimentContext& context, const SweepCase& c, Results& results) {
  const std::vector<MeasuredFrame> repeats = RecallCosts(context, c.team);
  results.Add(c.columns, "longest_render_time", EachOf(repeats, &MeasuredFrame::LongestSeconds), Origin::kSimulated);
  results.Add(c.columns, "picture_time", EachOf(repeats, &MeasuredFrame::finish_seconds), Origin::kSimulated);
}

void RunSweepHere(ExperimentContext& context, const Sweep& sweep, Results& results) {
  const std::vector<SweepCase> cases = CasesOf(context, sweep);
  std::vector<Trial> trials = {HostTrial()};
  for (const SweepCase& c : cases) {
    trials.push_back(CostTrial(context, c.team));
    trials.push_back(FinishTrial(context, c.team));
    if (c.served) trials.push_back(ServiceTrial(context, c.frame, kServiceFrames));
  }
  context.Run(std::move(trials));

  for (const SweepCase& c : cases) {
    AddFigures(results, c.columns, RecallFigures(context, c.team, c.link, c.teams, sweep.host));
    AddInputs(context, c, results);
    if (!c.served) continue;
    Json here = c.columns;
    here["link"] = "host";
    results.Add(here, "latency", ValuesOf(context.log(), ServiceKey(context, c.frame, kServiceFrames), "latency_ms", 1e-3),
                Origin::kMeasured);
  }
}

std::vector<ServedFrame> FramesAtService(const Sweep& sweep, int workers) {
  std::vector<ServedFrame> frames;
  for (const auto& [frame, names] : FramesOf(sweep)) {
    ServedFrame& served = frames.emplace_back(ServedFrame{frame, {}});
    served.frame.workers = workers;
    served.columns = ColumnsOf(served.frame);
    served.columns.update(names);
  }
  return frames;
}

SweepPlace PlaceOf(const ExperimentOptions& options) { return options.own.at_service() ? SweepPlace::kAtService : SweepPlace::kHere; }

}  // namespace

void DeclareSweep(const Command& app, OwnOptions& options) {
  AddService(app, options.service)
      .Description("Measure the frames of a service at this endpoint, with its workers and datasets; simulate nothing")
      .Default("none: workers are simulated from measurements on this machine");
}

std::vector<BenchCase> SweepVolumes(const ExperimentOptions& options) {
  return OrThrow(ReadSweep(options.sweep_file, SweepPlace::kAtService)).volumes;
}

void CheckSweepFile(const ExperimentOptions& options) { (void)OrThrow(ReadSweep(options.sweep_file, PlaceOf(options))); }

void RunSweep(ExperimentContext& context, Results& results) {
  const Sweep sweep = OrThrow(ReadSweep(context.options().sweep_file, PlaceOf(context.options())));
  if (context.options().own.at_service()) {
    MeasureAtService(context, results, [&](int workers) { return FramesAtService(sweep, workers); });
  } else {
    RunSweepHere(context, sweep, results);
  }
  results.Attach("sweep", {{{"title", sweep.title}}});
}

}  // namespace slabstream

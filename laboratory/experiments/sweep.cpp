#include <fmt/format.h>

#include <algorithm>

#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/sweep_file.h"

namespace slabstream {
namespace {

constexpr int kRepeats = 3, kQuickRepeats = 1, kServiceFrames = 5, kMeasuredWorkers = 2;

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
  const auto add = [&](const BenchCase& volume, const SweepRenderer& renderer, const SweepView& view, const SweepPolicy& policy,
                       int workers, const SweepLink& link) {
    SweepCase& c = cases.emplace_back();
    c.link = link.link;
    c.teams = std::min(policy.policy.teams, workers);
    c.team = {volume, sweep.size, view.view, policy.policy, workers / c.teams, renderer.look};
    c.team.volume.renderer = renderer.kind;
    c.team.policy.teams = 1;
    c.team = WithChosenPolicy(context, std::move(c.team), link.link);
    c.frame = c.team;
    c.frame.workers = workers;
    c.frame.policy.teams = policy.policy.teams;
    // The service has no link to vary: it follows the choice for the first one.
    c.served = workers <= kMeasuredWorkers && link.name == sweep.links.front().name;
    c.columns = ColumnsOf(c.frame);
    c.columns.update(Json{{"part", fmt::format("{}, {}, {}", volume.name, renderer.name, view.name)},
                          {"volume", volume.name},
                          {"view", view.name},
                          {"teams", c.teams},
                          {"variant", policy.name},
                          {"link", link.name}});
    if (c.team.policy.groups == 0) c.columns["groups"] = PlanOf(context, c.team).groups.size();
  };
  for (const BenchCase& volume : sweep.volumes) {
    for (const SweepRenderer& renderer : sweep.renderers) {
      for (const SweepView& view : sweep.views) {
        for (const SweepPolicy& policy : sweep.policies) {
          for (const int p : sweep.workers) {
            for (const SweepLink& link : sweep.links) add(volume, renderer, view, policy, p, link);
          }
        }
      }
    }
  }
  return cases;
}

}  // namespace

void CheckSweepFile(const ExperimentOptions& options) { (void)OrThrow(ReadSweep(options.sweep_file)); }

void RunSweep(ExperimentContext& context, Results& results) {
  const Sweep sweep = OrThrow(ReadSweep(context.options().sweep_file));
  const std::vector<SweepCase> cases = CasesOf(context, sweep);
  std::vector<Trial> trials = {HostTrial()};
  for (const SweepCase& c : cases) {
    trials.push_back(CostTrial(context, c.team));
    trials.push_back(FinishTrial(context, c.team));
    if (c.served) trials.push_back(ServiceTrial(context, c.frame, kServiceFrames));
  }
  context.Run(std::move(trials), kRepeats, kQuickRepeats);

  for (const SweepCase& c : cases) {
    AddFigures(results, c.columns, RecallFigures(context, c.team, c.link, c.teams));
    if (!c.served) continue;
    Json here = c.columns;
    here["link"] = "host";
    results.Add(here, "latency", EstimateOf(context.log(), ServiceKey(context, c.frame, kServiceFrames), "latency_ms").Times(1e-3),
                Origin::kMeasured);
  }
  results.Attach("sweep", {{{"title", sweep.title}}});
}

}  // namespace slabstream

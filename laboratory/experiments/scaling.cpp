#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/planning/policy_names.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
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
  context.Run(std::move(trials));

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

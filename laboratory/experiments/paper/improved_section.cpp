// Streaming, other partitions and balance, which the paper proposes, at the N of its tables.
#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "common/planning/policy_names.h"
#include "laboratory/experiments/attachments.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/paper/setup.h"
#include "laboratory/experiments/policies.h"

namespace slabstream {
namespace {

constexpr std::array<int, 4> kTeamSizes = {1, 2, 5, 10};  // in addition to all workers

std::vector<int> Workers(const PaperSetup& setup) {
  std::vector<int> workers = setup.workers();
  std::erase_if(workers, [](int p) { return p != 1 && p % 10 != 0; });
  return workers;
}

// Sizes of teams for p workers, the smallest first.
std::vector<int> TeamSizes(int workers) {
  std::vector<int> sizes;
  for (const int team : kTeamSizes) {
    if (team < workers && workers % team == 0) sizes.push_back(team);
  }
  sizes.push_back(workers);
  return sizes;
}

// Ways for a team to share a frame, besides the paper's equal slabs: partitions for equal work, one of them with dynamic balance.
std::vector<Policy> Partitions(int team) {
  if (team == 1) return {};
  std::vector<Policy> partitions = {BalancedTree().policy};
  for (const NamedPolicy& named : PartitionsAlongTheView()) partitions.push_back(named.policy);
  partitions.push_back(partitions.back());
  partitions.back().balance = kDynamicBalance;
  return partitions;
}

FrameCase With(FrameCase frame, const Policy& policy) {
  frame.policy = policy;
  return frame;
}

}  // namespace

std::vector<Trial> ImprovedTrials(const PaperSetup& setup) {
  std::set<int> teams;
  for (const int p : Workers(setup)) {
    for (const int team : TeamSizes(p)) teams.insert(team);
  }
  std::vector<FrameCase> frames;
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const int team : teams) {
      const FrameCase frame = frames.emplace_back(setup.Frame(renderer, setup.table_size(), team));
      for (const Policy& policy : Partitions(team)) frames.push_back(With(frame, policy));
    }
  }
  std::vector<Trial> trials = setup.TrialsOf(frames);
  trials.insert(trials.begin(), HostTrial());
  return trials;
}

void AddImproved(const PaperSetup& setup, Results& results) {
  for (const RendererKind* renderer : {Splatting(), ZBuffer()}) {
    for (const bool paper : {true, false}) {
      const std::vector<MachineModel> machines = paper ? setup.Machines(renderer) : Clusters(setup.context(), Link(kLink));
      // Latency and period of `workers` in teams of frame.workers.
      const auto add = [&](const FrameCase& frame, int workers, Images images) {
        const int teams = workers / frame.workers;
        std::vector<MeasuredFrame> repeats = RecallCosts(setup.context(), frame);
        for (MeasuredFrame& repeat : repeats) {
          if (paper) repeat = PaperSetup::AsPaper(std::move(repeat), images);
        }
        Json of = ColumnsOf(frame, {{"part", "beyond"}, {"variant", NameOf(images)}});
        of.update(Json{{"workers", workers}, {"teams", teams}, {"link", paper ? "paper" : kLink}});
        AddFigures(results, of, FindFigures(repeats, machines, teams));
      };
      for (const int p : Workers(setup)) {
        for (const int team : TeamSizes(p)) {
          const FrameCase frame = setup.Frame(renderer, setup.table_size(), team);
          if (paper && team == p) add(frame, p, Images::kWhole);
          add(frame, p, Images::kWithoutEmpty);
          for (const Policy& policy : Partitions(team)) {
            for (const std::string& scheme : UsualSchemes()) add(With(frame, Combined(policy, scheme)), p, Images::kWithoutEmpty);
          }
        }
      }
    }
  }

  // A few frames, asked for ahead.
  const int p = Workers(setup)[std::min<std::size_t>(1, Workers(setup).size() - 1)];
  const FrameCase slabs = setup.Frame(Splatting(), setup.table_size(), p);
  for (const auto& [name, frame] : {std::pair{"slabs", slabs}, {"kd-tree", With(slabs, BalancedTree().policy)}}) {
    const MeasuredFrame measured = Recall(setup.context(), frame);
    AttachTimeline(results, std::string("timeline-") + name, Simulate(measured, Cluster(setup.context(), Link(kLink)), 4, 4, true));
    AttachBoxes(results, std::string("boxes-") + name, measured);
  }
}

}  // namespace slabstream

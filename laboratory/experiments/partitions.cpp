#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "common/planning/assignment.h"
#include "laboratory/experiments/attachments.h"
#include "laboratory/experiments/compared_policies.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/owner_arrangements.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/experiments/subjects.h"

namespace slabstream {
namespace {

constexpr std::array<std::string_view, 2> kLinks = {"10gbit", "1gbit"};  // the first one wherever there is one link
constexpr std::array<std::string_view, 3> kSchemes = {"fan-in", kUsualScheme, "direct-send"};
constexpr std::array<int, 2> kGroups = {1, 2};

struct Comparison {
  std::vector<BenchCase> volumes;  // a volume for each of its renderers
  std::vector<int> workers;
  int pixels = 512;

  int TableWorkers() const { return workers[workers.size() / 2]; }
  FrameCase Frame(const BenchCase& volume, const Policy& policy, int p) const {
    return {volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), policy, p};
  }
};

Comparison ComparisonOf(const ExperimentContext& context) {
  const OwnOptions& own = context.options().own;
  Comparison comparison{.volumes = SubjectsOf(context.options(), context.Scaled(context.quick() ? 256 : 512)),
                        .workers = own.workers,
                        .pixels = context.Scaled(512)};
  if (own.workers.empty()) comparison.workers = context.quick() ? std::vector{2, 16} : std::vector{2, 16, 64};
  std::ranges::sort(comparison.workers);
  return comparison;
}

// Other boxes are cut for their owners, so that the assignment has little left to do.
std::vector<NamedPolicy> PartitionsByVoxels() {
  std::vector<NamedPolicy> policies = AllPartitions();
  std::erase_if(policies, [](const NamedPolicy& named) { return named.policy.balance_by != "voxels"; });
  return policies;
}

// The service's own assignments and those that it is compared with. Without owners, no box stays with one.
std::vector<AssignmentEntry> AssignmentsToCompare() {
  std::vector<AssignmentEntry> all = Assignments();
  std::erase_if(all, [](const AssignmentEntry& entry) { return entry.by_owner; });
  all.insert(all.end(), ComparedAssignments().begin(), ComparedAssignments().end());
  return all;
}

FrameCase OwnedFrame(const Comparison& comparison, const BenchCase& volume, std::string_view arrangement, int p) {
  return comparison.Frame(volume, Combined(EqualSlabs().policy, kUsualScheme, 1, arrangement), p);
}

std::vector<Trial> TrialsOf(ExperimentContext& context, const Comparison& comparison) {
  std::vector<Trial> trials = {HostTrial()};
  for (const BenchCase& volume : comparison.volumes) {
    const auto add_boxes = [&](const Policy& policy, int p) {
      trials.push_back(BoxCostTrial(context, comparison.Frame(volume, policy, p)));
    };
    trials.push_back(FinishTrial(context, comparison.Frame(volume, {}, 1)));
    add_boxes(Combined(EqualSlabs().policy, kUsualScheme), 1);
    for (const NamedPolicy& named : AllPartitions()) {
      for (const int p : comparison.workers) {
        for (const int groups : kGroups) add_boxes(Combined(named.policy, kUsualScheme, groups), p);
      }
    }
    for (const NamedPolicy& named : PartitionsByVoxels()) {
      for (const AssignmentEntry& assignment : AssignmentsToCompare())
        add_boxes(Combined(named.policy, kUsualScheme, kBoxesAWorker, assignment.name), comparison.TableWorkers());
    }
    for (const int p : comparison.workers) add_boxes({.groups = 1}, p);
    for (const OwnerArrangement& arrangement : OwnerArrangements()) {
      for (const int p : comparison.workers) trials.push_back(BoxCostTrial(context, OwnedFrame(comparison, volume, arrangement.name, p)));
    }
  }
  return trials;
}

Json CaseOf(std::string_view part, const FrameCase& frame, std::string_view link = "", Json more = Json::object()) {
  more["part"] = part;
  Json of = ColumnsOf(frame, std::move(more));
  if (link.empty()) {
    of.erase("combine");  // what is measured does not depend on it
  } else {
    of["link"] = link;
  }
  return of;
}

// What boxes alone tell.
void AddBoxFigures(Results& results, const Json& of, const std::vector<MeasuredFrame>& repeats) {
  results.Add(of, "imbalance", EachOf(repeats, &MeasuredFrame::ImbalanceOfWorkers), Origin::kMeasured);
  results.Add(of, "render_time", EachOf(repeats, &MeasuredFrame::RenderSeconds), Origin::kMeasured);
  results.Add(of, "longest_render_time", EachOf(repeats, &MeasuredFrame::LongestSeconds), Origin::kMeasured);
  results.Add(of, "memory", std::ranges::max(repeats.front().OfWorkers(&MeasuredFrame::Cost::voxel_bytes)), Origin::kMeasured);
}

void AddLatency(ExperimentContext& context, Results& results, std::string_view part, const FrameCase& frame,
                std::span<const std::string_view> links) {
  const std::vector<MeasuredFrame> repeats = RecallRepeats(context, frame);
  for (const std::string_view link : links) {
    const std::vector<MachineModel> machines = Clusters(context, Link(link));
    std::vector<double> seconds;
    for (std::size_t i = 0; i < std::min(repeats.size(), machines.size()); ++i)
      seconds.push_back(Simulate(repeats[i], machines[i]).frames.front().latency());
    results.Add(CaseOf(part, frame, link), "latency", seconds, Origin::kSimulated);
  }
}

// Every partition under every scheme, and what the service does if nothing is asked for.
void AddPolicies(ExperimentContext& context, const Comparison& comparison, const BenchCase& volume, Results& results) {
  const FrameCase whole = comparison.Frame(volume, Combined(EqualSlabs().policy, kUsualScheme), 1);
  AddBoxFigures(results, CaseOf("partition", whole), RecallRepeats(context, whole));
  AddLatency(context, results, "policy", whole, kLinks);
  for (const int p : comparison.workers) {
    if (p == 1) continue;
    for (const NamedPolicy& named : AllPartitions()) {
      const FrameCase boxes = comparison.Frame(volume, Combined(named.policy, kUsualScheme), p);
      AddBoxFigures(results, CaseOf("partition", boxes), RecallRepeats(context, boxes));
      for (const int groups : kGroups) {
        for (const std::string_view scheme : kSchemes)
          AddLatency(context, results, "policy", comparison.Frame(volume, Combined(named.policy, scheme, groups), p), kLinks);
      }
    }
    AddLatency(context, results, "default", comparison.Frame(volume, {.groups = 1}, p), kLinks);
  }
}

void AttachAllBoxes(ExperimentContext& context, const Comparison& comparison, const BenchCase& volume, Results& results) {
  for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
    const FrameCase frame = comparison.Frame(volume, Combined(named.policy, kUsualScheme), comparison.TableWorkers());
    AttachBoxes(results, fmt::format("boxes-{}-{}-{}", volume.dataset, volume.renderer->name(), named.policy.decomposition),
                Recall(context, frame));
  }
}

void AddAssignments(ExperimentContext& context, const Comparison& comparison, const BenchCase& volume, Results& results) {
  for (const NamedPolicy& named : PartitionsByVoxels()) {
    for (const AssignmentEntry& assignment : AssignmentsToCompare()) {
      const FrameCase frame =
          comparison.Frame(volume, Combined(named.policy, kUsualScheme, kBoxesAWorker, assignment.name), comparison.TableWorkers());
      AddBoxFigures(results, CaseOf("assignment", frame), RecallRepeats(context, frame));
    }
  }
}

// Voxels that stay with whoever holds them: how many groups that takes, and how many images travel.
void AddOwners(ExperimentContext& context, const Comparison& comparison, const BenchCase& volume, Results& results) {
  for (const OwnerArrangement& arrangement : OwnerArrangements()) {
    for (const int p : comparison.workers) {
      const FrameCase frame = OwnedFrame(comparison, volume, arrangement.name, p);
      const std::vector<MeasuredFrame> repeats = RecallRepeats(context, frame);
      const Json of = CaseOf("owners", frame);
      std::size_t boxes = 0, images = 0;
      for (const GroupPlan& group : repeats.front().plan.groups) {
        boxes += group.placements.size();
        images += AmongRuns(group.schedule).ranks;
      }
      const auto add_count = [&](std::string_view what, std::size_t count) {
        results.Add(CaseOf("owners", frame, "", {{"variant", what}}), "count", double(count), Origin::kMeasured);
      };
      add_count("boxes", boxes);
      add_count("groups", repeats.front().plan.groups.size());
      add_count("images", images);
      AddBoxFigures(results, of, repeats);
      AddLatency(context, results, "owners", frame, kLinks);
    }
  }
}

}  // namespace

void DeclarePartitions(const Command& app, OwnOptions& options) { DeclareSubjects(app, options, "2,16,64; with --quick 2,16"); }

void CheckPartitions(const ExperimentOptions& options) {
  CheckSubjects(SubjectsOf(options, kLeastScaledSide), BenchView(Projection::kOrthographic, 1, 12));
}

void RunPartitions(ExperimentContext& context, Results& results) {
  const Comparison comparison = ComparisonOf(context);
  context.Run(TrialsOf(context, comparison));
  for (const BenchCase& volume : comparison.volumes) {
    AddPolicies(context, comparison, volume, results);
    AttachAllBoxes(context, comparison, volume, results);
    AddAssignments(context, comparison, volume, results);
    AddOwners(context, comparison, volume, results);
  }
}

}  // namespace slabstream

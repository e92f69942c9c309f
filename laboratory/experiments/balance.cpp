#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <string_view>

#include "client/request/volume_argument.h"
#include "common/cli/add_option.h"
#include "common/planning/assignment.h"
#include "common/planning/policy_names.h"
#include "common/wire/validate_request.h"
#include "coordinator/tuning/box_estimator.h"
#include "laboratory/experiments/attachments.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/experiment.h"
#include "laboratory/experiments/figures.h"
#include "laboratory/experiments/machines.h"
#include "laboratory/experiments/policies.h"
#include "laboratory/experiments/view_sequence.h"

namespace slabstream {
namespace {

constexpr int kMostWorkers = 4096;
constexpr int kBoxesAWorker = 4;                                         // to compare assignments: with one box each they have no choice
constexpr std::array<std::string_view, 2> kLinks = {"10gbit", "1gbit"};  // the first one wherever there is one link
constexpr std::string_view kCombine = "radix-k";                         // wherever partitions alone are compared
constexpr std::array<std::string_view, 3> kSchemes = {"fan-in", kCombine, "direct-send"};
constexpr std::array<int, 2> kGroups = {1, 2};

struct Balance {
  std::vector<BenchCase> volumes;  // a volume for each of its renderers
  std::vector<int> workers;
  std::vector<const ViewMotion*> motions;
  std::optional<TransferChoice> later;  // of sequences
  std::vector<Policy> moving;           // to be compared in sequences
  int pixels = 512, steps = 8;

  int TableWorkers() const { return workers[workers.size() / 2]; }
  FrameCase Frame(const BenchCase& volume, const Policy& policy, int p) const {
    return {volume, {pixels, pixels}, BenchView(Projection::kOrthographic, 1, 12), policy, p};
  }
  ViewSequence Sequence(const BenchCase& volume, const Policy& policy, int p, const ViewMotion& motion, bool slowed = false) const {
    return {Frame(volume, policy, p), &motion, steps, later, slowed};
  }
};

// `size`: of a standard sphere.
std::vector<BenchCase> VolumesOf(const ExperimentOptions& options, int size) {
  const OwnOptions& own = options.own;
  std::vector<std::string> named = own.cases;
  named.insert(named.end(), options.volumes.begin(), options.volumes.end());
  std::vector<BenchCase> volumes;
  const auto add_with = [&](const RendererKind* renderer) {
    const std::size_t begin = volumes.size();
    if (own.cases.empty()) {
      const RendererKind* const kind = renderer != nullptr ? renderer : &DefaultRenderer();
      for (const SphereClass sphere : {SphereClass::kHollow, SphereClass::kFilled}) volumes.push_back(StandardSphere(sphere, size, kind));
      if (!options.quick || !named.empty()) std::ranges::move(RealVolumes(named), std::back_inserter(volumes));
    } else {
      std::ranges::move(NamedVolumes("VOLUME", named), std::back_inserter(volumes));
    }
    for (std::size_t i = begin; i < volumes.size(); ++i) {
      if (renderer != nullptr) volumes[i].renderer = renderer;
      if (!own.transfers.empty()) volumes[i].transfer = own.transfers.front();
    }
  };
  if (own.renderers.empty()) add_with(nullptr);
  for (const RendererKind* renderer : own.renderers) add_with(renderer);
  return volumes;
}

Policy Combined(Policy policy, std::string_view combine, int groups = 1, std::string_view assignment = "cyclic") {
  policy.combine = combine;
  policy.groups = groups;
  policy.assignment = assignment;
  return policy;
}

std::vector<const ViewMotion*> MotionsOf(const ExperimentOptions& options) {
  const std::vector<std::string>& named = options.own.views;
  const std::size_t standard = options.quick ? 1 : 2;
  std::vector<const ViewMotion*> motions;
  for (const ViewMotion& motion : ViewMotions()) {
    const bool wanted = named.empty() ? motions.size() < standard : std::ranges::find(named, motion.name) != named.end();
    if (wanted) motions.push_back(&motion);
  }
  return motions;
}

Balance BalanceOf(const ExperimentContext& context) {
  const OwnOptions& own = context.options().own;
  Balance balance{.volumes = VolumesOf(context.options(), context.Scaled(context.quick() ? 128 : 200)),
                  .pixels = context.Scaled(512),
                  .steps = context.quick() ? 4 : 8};
  balance.workers = !own.workers.empty() ? own.workers : context.quick() ? std::vector{2, 16} : std::vector{2, 16, 64};
  std::ranges::sort(balance.workers);
  balance.motions = MotionsOf(context.options());
  if (!own.transfers.empty()) balance.later = own.transfers.back();
  for (const NamedPolicy& named : {EqualSlabs(), BalancedSlabs(), BalancedTree()}) {
    for (const BalanceEntry& mode : Balances()) {
      balance.moving.push_back(Combined(named.policy, kCombine));
      balance.moving.back().balance = mode.name;
    }
  }
  return balance;
}

// Boxes by occupied voxels are cut for their owners, so that the assignment has little left to do.
std::vector<NamedPolicy> PartitionsByVoxels() {
  std::vector<NamedPolicy> policies = AllPartitions();
  std::erase_if(policies, [](const NamedPolicy& named) { return named.policy.balance_by != "voxels"; });
  return policies;
}

Policy Automatic() {
  Policy policy;
  policy.decomposition = policy.balance_by = policy.assignment = policy.combine = kAutomatic;
  return policy;
}

std::vector<Trial> TrialsOf(ExperimentContext& context, const Balance& balance) {
  std::vector<Trial> trials = {HostTrial()};
  for (const BenchCase& volume : balance.volumes) {
    const auto add_boxes = [&](const Policy& policy, int p) { trials.push_back(BoxCostTrial(context, balance.Frame(volume, policy, p))); };
    trials.push_back(FinishTrial(context, balance.Frame(volume, {}, 1)));
    add_boxes(Combined(EqualSlabs().policy, kCombine), 1);
    for (const NamedPolicy& named : AllPartitions()) {
      for (const int p : balance.workers) {
        for (const int groups : kGroups) add_boxes(Combined(named.policy, kCombine, groups), p);
      }
    }
    for (const NamedPolicy& named : PartitionsByVoxels()) {
      for (const AssignmentEntry& assignment : Assignments())
        add_boxes(Combined(named.policy, kCombine, kBoxesAWorker, assignment.name), balance.TableWorkers());
    }
    for (const int p : balance.workers) {
      for (const std::string_view link : kLinks)
        trials.push_back(BoxCostTrial(context, WithChosenPolicy(context, balance.Frame(volume, Automatic(), p), Link(link))));
      for (const ViewMotion* motion : balance.motions) {
        for (const Policy& policy : balance.moving) {
          const ViewSequence sequence = balance.Sequence(volume, policy, p, *motion);
          for (int step = 0; step < balance.steps; ++step) trials.push_back(FinishTrial(context, FrameOf(sequence, step)));
          trials.push_back(SequenceTrial(context, sequence));
        }
      }
    }
    for (const Policy& policy : balance.moving)
      trials.push_back(SequenceTrial(context, balance.Sequence(volume, policy, balance.TableWorkers(), *balance.motions.front(), true)));
  }
  return trials;
}

Json CaseOf(std::string_view part, const FrameCase& frame, std::string_view link = "") {
  Json of = {{"part", part}};
  of.update(ColumnsOf(frame));
  if (link.empty()) {
    of.erase("combine");  // what is measured does not depend on it
  } else {
    of["link"] = link;
  }
  return of;
}

// What boxes alone tell.
void AddBoxFigures(Results& results, const Json& of, const std::vector<MeasuredFrame>& repeats) {
  std::vector<double> imbalance, sum, longest;
  for (const MeasuredFrame& frame : repeats) {
    const std::vector<double> seconds = frame.WorkerSeconds();
    imbalance.push_back(Imbalance(seconds));
    sum.push_back(frame.RenderSeconds());
    longest.push_back(*std::ranges::max_element(seconds));
  }
  results.Add(of, "imbalance", imbalance, Origin::kMeasured);
  results.Add(of, "render_time", sum, Origin::kMeasured);
  results.Add(of, "longest_render_time", longest, Origin::kMeasured);
  results.Add(of, "memory", repeats.front().MostVoxelBytes(), Origin::kMeasured);
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

// Every partition under every scheme, and what `auto` takes.
void AddPolicies(ExperimentContext& context, const Balance& balance, const BenchCase& volume, Results& results) {
  const FrameCase whole = balance.Frame(volume, Combined(EqualSlabs().policy, kCombine), 1);
  AddBoxFigures(results, CaseOf("partition", whole), RecallRepeats(context, whole));
  AddLatency(context, results, "policy", whole, kLinks);
  for (const int p : balance.workers) {
    if (p == 1) continue;
    for (const NamedPolicy& named : AllPartitions()) {
      const FrameCase boxes = balance.Frame(volume, Combined(named.policy, kCombine), p);
      AddBoxFigures(results, CaseOf("partition", boxes), RecallRepeats(context, boxes));
      for (const int groups : kGroups) {
        for (const std::string_view scheme : kSchemes)
          AddLatency(context, results, "policy", balance.Frame(volume, Combined(named.policy, scheme, groups), p), kLinks);
      }
    }
    for (const std::string_view& link : kLinks) {
      const FrameCase chosen = WithChosenPolicy(context, balance.Frame(volume, Automatic(), p), Link(link));
      AddLatency(context, results, "auto", chosen, std::span(&link, 1));
    }
  }
}

// What the planner expects boxes to take before it has seen a frame, beside what they take.
void AddBoxes(ExperimentContext& context, const Balance& balance, const BenchCase& volume, Results& results) {
  for (const NamedPolicy& named : {EqualSlabs(), BalancedTree()}) {
    const FrameCase frame = balance.Frame(volume, Combined(named.policy, kCombine), balance.TableWorkers());
    const std::vector<MeasuredFrame> repeats = RecallRepeats(context, frame);
    const FramePlan& plan = repeats.front().plan;
    const VolumeInUse in_use = context.volumes().Get(frame.volume);
    const auto occupied = context.volumes().Occupied(frame.volume);
    const BoxEstimator estimator(plan.setup, *in_use.summary, *occupied, nullptr, 1);
    for (const Placement& placement : PlacementsOf(plan)) {
      Json of = CaseOf("box", frame);
      of["box"] = placement.id;
      std::vector<double> seconds;
      seconds.reserve(repeats.size());
      for (const MeasuredFrame& repeat : repeats) seconds.push_back(repeat.boxes[placement.id].seconds);
      results.Add(of, "box_time", seconds, Origin::kMeasured);
      results.Add(of, "estimated_box_time", estimator.Of(placement.box).seconds, Origin::kSimulated);
    }
    AttachBoxes(results, fmt::format("boxes-{}-{}-{}", volume.dataset, volume.renderer->name(), named.policy.decomposition),
                Recall(context, frame));
  }
}

void AddAssignments(ExperimentContext& context, const Balance& balance, const BenchCase& volume, Results& results) {
  for (const NamedPolicy& named : PartitionsByVoxels()) {
    for (const AssignmentEntry& assignment : Assignments()) {
      const FrameCase frame =
          balance.Frame(volume, Combined(named.policy, kCombine, kBoxesAWorker, assignment.name), balance.TableWorkers());
      AddBoxFigures(results, CaseOf("assignment", frame), RecallRepeats(context, frame));
    }
  }
}

// Each step, and without `step` the mean over the steps.
void AddSequence(ExperimentContext& context, const ViewSequence& sequence, std::string_view part, Results& results) {
  struct Figure {
    const char* metric;
    std::vector<std::vector<double>> values;  // by step and repeat
    std::vector<double> means;                // by repeat
  };
  const std::vector<MachineModel> machines = Clusters(context, Link(kLinks.front()));
  std::vector<Figure> figures = {{"latency", {}, {}}, {"imbalance", {}, {}}, {"voxel_bytes", {}, {}}};
  for (Figure& figure : figures) figure.values.resize(std::size_t(sequence.steps));
  const std::vector<SequenceFrames> repeats = RecallSequence(context, sequence);
  for (std::size_t repeat = 0; repeat < std::min(repeats.size(), machines.size()); ++repeat) {
    std::array<double, 3> sums{};
    for (std::size_t step = 0; step < repeats[repeat].size(); ++step) {
      const MeasuredFrame& frame = repeats[repeat][step];
      const double fetched = std::transform_reduce(frame.boxes.begin(), frame.boxes.end(), 0.0, std::plus(),
                                                   [](const MeasuredFrame::Cost& box) { return box.fetched_bytes; });
      const std::array<double, 3> found = {Simulate(frame, machines[repeat]).frames.front().latency(), Imbalance(frame.WorkerSeconds()),
                                           fetched};
      for (std::size_t i = 0; i < figures.size(); ++i) {
        figures[i].values[step].push_back(found[i]);
        sums[i] += found[i];
      }
    }
    for (std::size_t i = 0; i < figures.size(); ++i) figures[i].means.push_back(sums[i] / sequence.steps);
  }
  Json of = CaseOf(part, sequence.frame, kLinks.front());
  of["view"] = sequence.motion->name;
  for (const Figure& figure : figures) {
    const Origin origin = figure.metric == std::string_view("latency") ? Origin::kSimulated : Origin::kMeasured;
    results.Add(of, figure.metric, figure.means, origin);
    for (std::size_t step = 0; step < figure.values.size(); ++step) {
      Json at = of;
      at["step"] = step;
      results.Add(at, figure.metric, figure.values[step], origin);
    }
  }
}

// Every method under the same views.
void AddSequences(ExperimentContext& context, const Balance& balance, const BenchCase& volume, int p, const ViewMotion& motion, bool slowed,
                  Results& results) {
  const std::string_view part = slowed ? "slowed" : "sequence";
  for (const Policy& policy : balance.moving) AddSequence(context, balance.Sequence(volume, policy, p, motion, slowed), part, results);
}

}  // namespace

void DeclareBalance(CLI::App& app, OwnOptions& options) {
  app.add_option("VOLUME", options.cases,
                 "Volumes instead of the standard ones: FILE, FILE:TRANSFER or a case of `slabstream bench --list`, such as class1-256");
  AddParsedList(
      app, "--workers", options.workers,
      [](const std::string& option, const std::string& text) { return ParseInteger(option, text, 1, kMostWorkers); },
      "Numbers of workers (default: 2,16,64; with --quick 2,16)");
  AddParsedList(
      app, "--renderer", options.renderers,
      [](const std::string& option, const std::string& text) -> Result<const RendererKind*> {
        const Result<std::size_t> index = ParseChoice(option, text, RendererNames());
        if (!index.ok()) return index.status();
        return Renderers()[*index];
      },
      "How voxels become a picture; every volume is rendered by each (default: splat)");
  std::vector<std::string_view> names;
  for (const ViewMotion& motion : ViewMotions()) names.push_back(motion.name);
  AddParsedList(app, "--views", options.views, OneOf(names),
                "Sequences of views (default: turntable,zoom-in; with --quick turntable)" + Explained(ViewMotions()));
  AddParsedList(
      app, "--transfer", options.transfers,
      [](const std::string& option, const std::string& text) -> Result<TransferChoice> {
        auto parsed = ParseTransfer(option, text);
        if (!parsed.ok()) return parsed.status();
        return TransferChoice{*std::move(parsed)};
      },
      "Two transfer functions, as for `slabstream render`: in the middle of each sequence the first gives way to the second")
      ->type_name("A,B");
}

void CheckBalance(const ExperimentOptions& options) {
  const std::size_t transfers = options.own.transfers.size();
  if (transfers != 0 && transfers != 2)
    throw Failure(
        Status::InvalidArgument(fmt::format("--transfer needs two transfer functions that differ, A,B; {} was given", transfers)));
  for (const BenchCase& volume : VolumesOf(options, kLeastScaledSide)) {
    for (const ViewMotion* motion : MotionsOf(options)) {
      OrThrow(Validate(RequestOf({.volume = volume, .size = {1, 1}, .view = motion->at(0), .policy = {}})));
    }
  }
}

void RunBalance(ExperimentContext& context, Results& results) {
  const Balance balance = BalanceOf(context);
  context.Run(TrialsOf(context, balance));
  for (const BenchCase& volume : balance.volumes) {
    AddPolicies(context, balance, volume, results);
    AddBoxes(context, balance, volume, results);
    AddAssignments(context, balance, volume, results);
    for (const ViewMotion* motion : balance.motions) {
      for (const int p : balance.workers) AddSequences(context, balance, volume, p, *motion, false, results);
    }
    AddSequences(context, balance, volume, balance.TableWorkers(), *balance.motions.front(), true, results);
  }
}

}  // namespace slabstream

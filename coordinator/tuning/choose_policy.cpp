#include "coordinator/tuning/choose_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/brick_visibility.h"
#include "common/planning/clipped_cells.h"
#include "common/planning/frame_occlusion.h"
#include "common/planning/layer_bricks.h"
#include "common/planning/least_extinction.h"
#include "common/planning/policy_names.h"
#include "common/renderers/renderer_kind.h"
#include "coordinator/tuning/frame_predictor.h"

namespace slabstream {
namespace {

constexpr int kGroupFactors[] = {1, 2, 4};        // times the fewest that memory allows
constexpr int kPartitionGroupFactors[] = {1, 2};  // likewise, to judge partitions
// To judge partitions, where the scheme is open: a tree, and two that divide the picture among the workers. How well a partition does
// depends on them, since boxes whose images overlap little are quick to exchange.
constexpr const char* kPartitionSchemes[] = {"fan-in", "radix-k", "direct-send"};

// Schemes by the names of their entries, and with arguments: trees of other arity, more strips.
std::vector<std::string> SchemesToTry() {
  std::vector<std::string> schemes;
  for (const CombiningEntry& entry : CombiningSchemes()) {
    schemes.emplace_back(entry.name);
    if (entry.takes_strips) {
      for (const int strips : {4, 16}) schemes.push_back(fmt::format("{}:strips={}", entry.name, strips));
    }
    if (entry.most_factors > 0) schemes.push_back(fmt::format("{}:8", entry.name));
  }
  return schemes;
}

// Workers of different hosts, which send each other images.
bool HasLinks(const MachineModel& machine, std::size_t workers) { return workers > std::size_t(machine.workers_a_host); }

class Search {
 public:
  Search(const PolicyQuestion& question, const FramePredictor& predictor)
      : question_(question),
        layouts_({.summary = question.resolved->summary.get(),
                  .volume = &question.resolved->volume,
                  .slots = question.slots,
                  .box_bytes_target = question.box_bytes_target,
                  .known = question.known,
                  .stop = question.stop}),
        predictor_(predictor),
        asked_(*question.open),
        open_partition_(asked_.decomposition == kAutomatic),
        open_owners_(open_partition_ || asked_.assignment == kAutomatic),
        open_groups_(asked_.groups == 0 && HasLinks(*question.machine, question.slots)) {
    if (question.now != nullptr) {
      best_ = *question.now;
      return;
    }
    best_ = ResolvePolicy(FixedPolicy(asked_), question.resolved->summary->description.geometry);
    best_.groups = FewestGroupsOf(best_);
  }

  PolicyChoice Run() {
    const ResolvedPolicy first = best_;  // best_ changes meanwhile
    TryLayout(first, open_partition_);
    if (open_partition_) ChoosePartition();
    if (open_owners_ || open_groups_) ChooseGroupsAndOwners();
    if (asked_.combine == kAutomatic) ChooseScheme();
    return {best_, stands_in_ ? std::nullopt : prediction_, predicted_};
  }

 private:
  // The fewest groups that a policy may have: those that were asked for, if any.
  int FewestGroupsOf(ResolvedPolicy policy) {
    policy.groups = asked_.groups;
    return layouts_.FewestGroups(policy);
  }

  void ChoosePartition() {
    for (const DecompositionEntry& entry : Decompositions()) {
      for (const BalanceBy metric : {BalanceBy::kVoxels, BalanceBy::kOccupied, BalanceBy::kCost}) {
        const bool wanted = asked_.balance_by == kAutomatic || asked_.balance_by == NameOf(metric);
        // Until costs are known, balancing by cost is balancing by occupied voxels.
        const bool same = asked_.balance_by == kAutomatic && metric == BalanceBy::kCost && question_.known.cost == nullptr;
        if (!wanted || same) continue;
        ResolvedPolicy policy = best_;
        policy.decomposition = &entry;
        policy.balance_by = metric;
        policy.axis = SlabAxis(asked_.axis, entry, question_.resolved->summary->description.geometry.size);
        const int fewest = FewestGroupsOf(policy);
        for (const int factor : kPartitionGroupFactors) {
          if (factor > 1 && asked_.groups > 0) break;
          policy.groups = std::min(factor * fewest, kMaxGroups);
          TryLayout(policy, true);
        }
      }
    }
  }

  void ChooseGroupsAndOwners() {
    const ResolvedPolicy start = best_;
    const int fewest = FewestGroupsOf(start);
    for (const int factor : kGroupFactors) {
      if (factor > 1 && asked_.groups > 0) break;
      for (const AssignmentEntry& entry : Assignments()) {
        ResolvedPolicy policy = start;
        if (asked_.assignment == kAutomatic) policy.assignment = &entry;
        policy.groups = std::min(factor * fewest, kMaxGroups);
        TryLayout(policy, false);
        if (asked_.assignment != kAutomatic) break;
      }
    }
  }

  void ChooseScheme() {
    if (!prediction_) return;
    for (const std::string& scheme : SchemesToTry()) {
      if (question_.stop.stop_requested()) return;
      ResolvedPolicy policy = best_;
      policy.combine = scheme;
      if (const auto prediction = predictor_.Predict(prepared_, scheme)) Consider(policy, *prediction, kLeastGain);
    }
  }

  // Layouts that have been tried under another name are not tried again. `schemes`: under all kPartitionSchemes, if the scheme is open.
  void TryLayout(const ResolvedPolicy& policy, bool schemes) {
    if (question_.stop.stop_requested()) return;
    Layout layout = layouts_.Make(policy);
    if (std::ranges::find(tried_, layout) != tried_.end()) return;
    tried_.push_back(layout);
    FramePredictor::Prepared prepared = predictor_.Prepare(std::move(layout));
    const bool is_now = question_.now != nullptr && tried_.size() == 1;
    // What holds has voxels where they are; another layout moves them. Its own schemes and the next layouts are compared as any others.
    const double least_gain = holds_now_ && !is_now ? std::max(kLeastGain, question_.least_gain) : kLeastGain;
    // A requested scheme may have too many steps to be tried: the default one then compares the layouts.
    std::optional<FramePrediction> prediction = predictor_.Predict(prepared, policy.combine);
    const bool stands_in = !prediction;
    if (stands_in) prediction = predictor_.Predict(prepared, Policy{}.combine);
    bool better = prediction && Consider(policy, *prediction, least_gain);
    if (better) stands_in_ = stands_in;
    for (const char* const scheme : kPartitionSchemes) {
      if (!schemes || asked_.combine != kAutomatic || scheme == policy.combine || question_.stop.stop_requested()) continue;
      ResolvedPolicy other = policy;
      other.combine = scheme;
      prediction = predictor_.Predict(prepared, scheme);
      if (!prediction || !Consider(other, *prediction, better ? kLeastGain : least_gain)) continue;
      better = true;
      stands_in_ = false;
    }
    if (!better) return;
    holds_now_ = is_now;
    prepared_ = std::move(prepared);
  }

  bool Consider(const ResolvedPolicy& policy, const FramePrediction& prediction, double least_gain) {
    ++predicted_;
    if (prediction_ && prediction.latency_seconds >= (1 - least_gain) * prediction_->latency_seconds) return false;
    best_ = policy;
    prediction_ = prediction;
    return true;
  }

  const PolicyQuestion& question_;
  LayoutMaker layouts_;
  const FramePredictor& predictor_;
  const Policy& asked_;
  const bool open_partition_, open_owners_, open_groups_;
  ResolvedPolicy best_;
  std::optional<FramePrediction> prediction_;  // of best_; prepared_ is its layout
  FramePredictor::Prepared prepared_;
  bool holds_now_ = false;  // best_ has the layout of question_.now
  bool stands_in_ = false;  // prediction_ is for the default scheme in place of best_'s
  std::vector<Layout> tried_;
  int predicted_ = 0;
};

}  // namespace

bool LeavesChoice(const Policy& policy, const MachineModel& machine, std::size_t workers) {
  return LeavesChoice(policy) || (policy.groups == 0 && HasLinks(machine, workers));
}

Policy FixedPolicy(Policy policy) {
  const Policy defaults;
  if (policy.decomposition == kAutomatic) policy.decomposition = defaults.decomposition;
  if (policy.assignment == kAutomatic) policy.assignment = defaults.assignment;
  if (policy.combine == kAutomatic) policy.combine = defaults.combine;
  policy.balance_by = BalanceByOf(policy);
  return policy;
}

Policy FirstPolicy(Policy policy, std::size_t workers) {
  constexpr std::size_t kManyWorkers = 8;
  if (policy.decomposition == kAutomatic) {
    policy.decomposition = "kd-tree";
    if (policy.balance_by == kAutomatic) policy.balance_by = NameOf(BalanceBy::kOccupied);
  }
  if (policy.combine == kAutomatic && workers >= kManyWorkers) policy.combine = "radix-k";
  return FixedPolicy(std::move(policy));
}

PolicyChoice ChoosePolicy(const PolicyQuestion& question) {
  const ClassifiedVolume& volume = question.resolved->volume;
  const VolumeSummary& summary = *question.resolved->summary;
  std::optional<OccupancyGrid> drawn;
  if (question.known.occupied == nullptr) {
    drawn = BrickVisibility(summary, volume.renderer()->DrawnTable(volume.transfer(), summary),
                            LayerBricks(summary, *volume.renderer(), volume.looks()))
                .VisibleCells();
  } else if (!volume.clip().empty()) {
    drawn = *question.known.occupied;
  }
  if (drawn) EmptyClippedCells(volume.clip(), *drawn);
  FrameSetup setup = *question.setup;
  if (UsesOcclusion(setup)) setup.front = FindOpaqueFront(FindLeastExtinction(summary, volume), setup);
  const FramePredictor predictor(setup, summary, drawn ? *drawn : *question.known.occupied, question.known.cost, *question.machine,
                                 question.slots, question.render_scale);
  return Search(question, predictor).Run();
}

}  // namespace slabstream

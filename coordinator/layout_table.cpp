#include "coordinator/layout_table.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "common/planning/clipped_cells.h"
#include "coordinator/learning_table.h"

namespace slabstream {
namespace {

// Render time of each box that was rendered.
std::map<BoxId, double> SecondsOf(const Layout& layout, std::span<const RankReport> reports) {
  std::map<BoxId, double> seconds;
  for (const RankReport& report : reports) {
    // Reports that come with a picture concern no box.
    if (report.stage_ns[std::size_t(Stage::kRender)] <= 0 || report.box >= layout.owners.size() || layout.owners[report.box] == kNoSlot)
      continue;
    seconds[report.box] = 1e-9 * double(LastingRenderNs(report));
  }
  return seconds;
}

}  // namespace

LayoutTable::Learnt* LayoutTable::FindLearnt(const ClassifiedVolume& volume) {
  const auto found = std::ranges::find(learnt_, volume, &Learnt::volume);
  if (found == learnt_.end()) return nullptr;
  learnt_.splice(learnt_.begin(), learnt_, found);
  return &*found;
}

std::optional<MeasuredCost> LayoutTable::CopyLearnt(const ClassifiedVolume& volume) {
  const std::lock_guard lock(mutex_);
  const Learnt* const learnt = FindLearnt(volume);
  return learnt != nullptr && learnt->cost.any() ? std::optional(learnt->cost) : std::nullopt;
}

LayoutTable::Key LayoutTable::KeyOf(const Request& request, bool counted) {
  Key key{*request.volume, *request.policy, request.slots, request.box_bytes_target, !counted && NeedsOccupancy(AskFor(*request.policy))};
  if (request.map != nullptr) key.map = *request.map;
  key.policy.combine.clear();
  key.policy.pixel_error = 0;
  return key;
}

std::shared_ptr<const Layout> LayoutTable::Find(const Request& request) {
  const ResolvedPolicy& policy = *request.policy;
  const BalanceEntry& balance = *policy.balance;
  const Key key = KeyOf(request, request.occupied != nullptr);
  std::unique_lock lock(mutex_);
  if (request.occupied != nullptr && FindLearnt(key.volume) == nullptr) {
    lock.unlock();
    OccupancyGrid drawn = *request.occupied;
    EmptyClippedCells(key.volume.clip(), drawn);
    MeasuredCost cost(drawn);
    lock.lock();
    if (FindLearnt(key.volume) == nullptr) {
      learnt_.push_front({key.volume, std::move(cost)});
      KeepFirst(learnt_, kMaxLearnt);
    }
  }
  const Learnt* const learnt = request.occupied == nullptr ? nullptr : FindLearnt(key.volume);
  const bool known = learnt != nullptr && learnt->cost.any();

  if (key.by_bricks) {  // a layout by counted voxels is better, and its voxels are where it wants them
    Key counted = key;
    counted.by_bricks = false;
    if (const auto better = std::ranges::find(entries_, counted, &Entry::key); better != entries_.end()) return better->layout;
  }
  std::shared_ptr<const Layout> present;  // null: none is made
  std::vector<double> seconds;            // of its boxes
  int frames_seen = 0;
  if (const auto found = std::ranges::find(entries_, key, &Entry::key); found != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, found);
    const bool rebalance = known && balance.change != nullptr && found->frames_seen > 0;
    const bool remake = known && balance.change == nullptr && !found->by_cost && policy.balance_by == BalanceBy::kCost;
    if (!rebalance && !remake) return found->layout;
    present = found->layout;
    seconds = found->seconds;
    frames_seen = found->frames_seen;
  }
  lock.unlock();

  std::optional<WorkField> cost;
  if (known) {
    if (const std::optional<MeasuredCost> copy = CopyLearnt(key.volume)) cost.emplace(copy->Field());
  }
  if (present != nullptr && !cost) return present;  // what was known was dropped meanwhile
  const LayoutRequest make{.summary = request.summary,
                           .volume = request.volume,
                           .policy = &policy,
                           .slots = request.slots,
                           .box_bytes_target = request.box_bytes_target,
                           .map = request.map.get(),
                           .coarser = request.coarser,
                           .known = {.occupied = request.occupied.get(), .cost = cost ? &*cost : nullptr},
                           .stop = request.stop};
  const bool rebalance = present != nullptr && balance.change != nullptr;
  std::optional<Layout> made = rebalance ? balance.change({present.get(), seconds, &make, frames_seen}) : MakeLayout(make);
  if (request.stop.stop_requested()) return nullptr;

  lock.lock();
  const auto found = std::ranges::find(entries_, key, &Entry::key);
  if (found == entries_.end()) {
    entries_.push_front({key, made ? std::make_shared<const Layout>(*std::move(made)) : present, cost.has_value(), 0, {}});
    KeepFirst(entries_, kMaxKept);
    return entries_.front().layout;
  }
  Entry& entry = *found;
  if (entry.layout != present) return entry.layout;  // another thread was quicker
  entry.by_cost = entry.by_cost || cost.has_value();
  if (made && *made != *present) {
    entry.layout = std::make_shared<const Layout>(*std::move(made));
    entry.frames_seen = 0;
    entry.seconds.clear();
  }
  return entry.layout;
}

bool LayoutTable::HasMade(const Request& request) {
  Key key = KeyOf(request, true);
  const std::unique_lock lock(mutex_, std::try_to_lock);
  return lock && std::ranges::any_of(entries_, [&](const Entry& entry) {
           key.box_bytes_target = entry.key.box_bytes_target;
           return entry.key == key;
         });
}

std::shared_ptr<const Layout> LayoutTable::FindMade(const Request& request) {
  const ResolvedPolicy& policy = *request.policy;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || policy.balance->change != nullptr) return nullptr;
  const auto found = std::ranges::find(entries_, KeyOf(request, true), &Entry::key);
  if (found == entries_.end()) return nullptr;
  if (policy.balance_by == BalanceBy::kCost && !found->by_cost) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return entries_.front().layout;
}

bool LayoutTable::KnowsCost(const ClassifiedVolume& volume) {
  const std::lock_guard lock(mutex_);
  const Learnt* const learnt = FindLearnt(volume);
  return learnt != nullptr && learnt->cost.any();
}

std::optional<WorkField> LayoutTable::KnownCost(const ClassifiedVolume& volume) {
  const std::optional<MeasuredCost> learnt = CopyLearnt(volume);
  return learnt ? std::optional(learnt->Field()) : std::nullopt;
}

void LayoutTable::Learn(const ClassifiedVolume& volume, const FramePlan& plan, const ResolvedPolicy& policy,
                        std::span<const RankReport> reports) {
  const std::map<BoxId, double> seconds = SecondsOf(*plan.layout, reports);
  if (seconds.empty()) return;
  Key key = KeyOf({.policy = &policy, .volume = &volume, .slots = plan.slots}, true);
  const std::lock_guard lock(mutex_);
  Learnt* const learnt = FindLearnt(volume);
  if (learnt == nullptr) return;
  const auto is_of = [&](const Entry& e) {
    key.box_bytes_target = e.key.box_bytes_target;  // the layout tells
    return e.key == key && (e.layout == plan.layout || *e.layout == *plan.layout);
  };
  const auto entry = std::ranges::find_if(entries_, is_of);
  // The first frame of a layout counts most; a frame of a layout that has been changed since counts as an average one.
  double weight = kLeastWeight;
  if (entry != entries_.end()) {
    weight = std::max(weight, 1.0 / ++entry->frames_seen);
    entry->seconds.resize(plan.layout->owners.size());
  }
  std::vector<BoxSeconds> boxes;
  for (const auto& [box, time] : seconds) {
    boxes.push_back({plan.layout->partition.boxes()[box], time});
    if (entry == entries_.end()) continue;
    double& known = entry->seconds[box];
    known = known == 0 ? time : known + weight * (time - known);
  }
  learnt->cost.Learn(boxes, weight);
}

}  // namespace slabstream

#include "coordinator/layout_table.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "common/planning/balance.h"
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

LayoutTable::Key LayoutTable::KeyOf(const ClassifiedVolume& volume, const ResolvedPolicy& policy, std::uint32_t slots) {
  Key key{volume, policy, slots};
  key.policy.combine.clear();
  key.policy.pixel_error = 0;
  return key;
}

std::shared_ptr<const Layout> LayoutTable::Find(const Request& request) {
  const ResolvedPolicy& policy = *request.policy;
  Key key = KeyOf(*request.volume, policy, request.slots);

  Learnt* learnt = nullptr;
  if (request.occupied != nullptr) {
    learnt = FindLearnt(key.volume);
    if (learnt == nullptr) {
      OccupancyGrid drawn = *request.occupied;
      EmptyClippedCells(key.volume.clip(), drawn);
      learnt = &learnt_.emplace_front(Learnt{key.volume, MeasuredCost(drawn)});
      KeepFirst(learnt_, kMaxLearnt);
    }
  }
  const bool known = learnt != nullptr && learnt->cost.any();
  LayoutRequest make{.summary = request.summary,
                     .volume = request.volume,
                     .policy = &policy,
                     .slots = request.slots,
                     .known = {.occupied = request.occupied.get()}};
  std::optional<WorkField> cost;
  const auto with_cost = [&]() -> const LayoutRequest& {
    if (known && !cost) make.known.cost = &cost.emplace(learnt->cost.Field());
    return make;
  };

  const auto found = std::ranges::find(entries_, key, &Entry::key);
  if (found == entries_.end()) {
    entries_.push_front({std::move(key), std::make_shared<const Layout>(MakeLayout(with_cost())), known, 0, 0, {}});
    KeepFirst(entries_, kMaxKept);
    return entries_.front().layout;
  }
  entries_.splice(entries_.begin(), entries_, found);
  Entry& entry = *found;
  std::optional<Layout> better;
  if (known && policy.dynamic_balance) {
    if (entry.frames_seen >= std::clamp(entry.changes, 1, kMostPatience))
      better = Rebalance(*entry.layout, entry.seconds, with_cost(), entry.frames_seen);
  } else if (known && !entry.by_cost && policy.balance_by == BalanceBy::kCost) {
    better = MakeLayout(with_cost());
    entry.by_cost = true;
  }
  if (better && *better != *entry.layout) {
    entry.layout = std::make_shared<const Layout>(*std::move(better));
    ++entry.changes;
    entry.frames_seen = 0;
    entry.seconds.clear();
  }
  return entry.layout;
}

std::shared_ptr<const Layout> LayoutTable::FindMade(const Request& request) {
  const ResolvedPolicy& policy = *request.policy;
  const auto found = std::ranges::find(entries_, KeyOf(*request.volume, policy, request.slots), &Entry::key);
  if (found == entries_.end() || policy.dynamic_balance) return nullptr;
  if (policy.balance_by == BalanceBy::kCost && !found->by_cost) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return entries_.front().layout;
}

bool LayoutTable::KnowsCost(const ClassifiedVolume& volume) {
  const Learnt* const learnt = FindLearnt(volume);
  return learnt != nullptr && learnt->cost.any();
}

std::optional<WorkField> LayoutTable::KnownCost(const ClassifiedVolume& volume) {
  if (!KnowsCost(volume)) return std::nullopt;
  return learnt_.front().cost.Field();
}

void LayoutTable::Learn(const ClassifiedVolume& volume, const FramePlan& plan, const ResolvedPolicy& policy,
                        std::span<const RankReport> reports) {
  Learnt* const learnt = FindLearnt(volume);
  if (learnt == nullptr) return;
  const std::map<BoxId, double> seconds = SecondsOf(*plan.layout, reports);
  if (seconds.empty()) return;
  const Key key = KeyOf(volume, policy, plan.slots);
  const auto is_of = [&](const Entry& e) { return e.key == key && (e.layout == plan.layout || *e.layout == *plan.layout); };
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

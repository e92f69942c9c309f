#include "coordinator/planner/layout_table.h"

#include <algorithm>
#include <map>
#include <utility>

#include "common/planning/balance.h"

namespace slabstream {
namespace {

// Rendering without what is done once a padded box, which the next frame does not repeat. 0: none is reported.
std::int64_t LastingRenderNs(const RankReport& report) {
  const auto stage = [&report](Stage s) { return report.stage_ns[std::size_t(s)]; };
  return std::max<std::int64_t>(stage(Stage::kRender) - stage(Stage::kPrepare), 0);
}

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

// What the first frame of a layout tells of it.
MoveSeconds MoveSecondsOf(const Layout& layout, std::int64_t bytes_per_voxel, std::span<const RankReport> reports) {
  double fetch_seconds = 0, moved = 0;
  MoveSeconds move;
  for (const RankReport& report : reports) {
    const auto seconds = [&report](Stage stage) { return 1e-9 * double(report.stage_ns[std::size_t(stage)]); };
    if (report.box >= layout.owners.size()) continue;
    if (report.voxel_bytes > 0) {
      fetch_seconds = std::max(fetch_seconds, seconds(Stage::kFetch));
      moved += double(report.voxel_bytes) / double(bytes_per_voxel);
    }
    // A worker may have had a box before, and then takes only a moment. A new one takes longest.
    const double prepare = seconds(Stage::kPrepare) / double(layout.partition.boxes()[report.box].voxel_count());
    if (prepare > 0) move.prepare = std::max(move.prepare.value_or(0), prepare);
  }
  if (moved > 0) move.fetch = fetch_seconds / moved;
  return move;
}

void Follow(std::optional<double>& known, const std::optional<double>& seen) {
  constexpr double kWeight = 0.5;  // of the newest: changes are few
  if (seen) known = known ? *known + kWeight * (*seen - *known) : *seen;
}

}  // namespace

std::shared_ptr<const Layout> LayoutTable::FindEarlier(const Key& key) const {
  for (const auto& entry : entries_.entries()) {
    Key same = key;
    same.volume = entry.key.volume;
    if (same.volume.dataset() == key.volume.dataset() && same == entry.key) return entry.value.layout;
  }
  return nullptr;
}

std::optional<WorkField> LayoutTable::KnownCost(const ClassifiedVolume& volume) {
  std::optional<MeasuredCost> known;
  {
    const std::lock_guard lock(mutex_);
    if (const Learnt* const learnt = learnt_.Find(volume); learnt != nullptr && learnt->cost.any()) known = learnt->cost;
  }
  return known ? std::optional(known->Field()) : std::nullopt;
}

LayoutTable::Key LayoutTable::KeyOf(const Request& request) {
  Key key{*request.volume, *request.policy, request.slots, request.hosts, request.box_bytes_target};
  if (request.map != nullptr) key.map = *request.map;
  key.policy.combine.clear();
  key.policy.pixel_error = 0;
  return key;
}

std::shared_ptr<const Layout> LayoutTable::Find(const Request& request) {
  const Key key = KeyOf(request);
  std::unique_lock lock(mutex_);
  if (request.occupied != nullptr && learnt_.Find(key.volume) == nullptr) {
    lock.unlock();
    OccupancyGrid drawn = *request.occupied;
    EmptyClippedCells(key.volume.clip(), request.summary->description.geometry, drawn);
    MeasuredCost cost(drawn);
    lock.lock();
    if (learnt_.Find(key.volume) == nullptr) {
      learnt_.Put(key.volume, {.cost = std::move(cost)});
      learnt_.DropBeyond(kMaxLearnt);
    }
  }
  if (const Entry* found = entries_.Find(key)) return found->layout;
  const std::shared_ptr<const Layout> earlier = FindEarlier(key);
  lock.unlock();

  const std::optional<WorkField> cost = request.occupied != nullptr ? KnownCost(key.volume) : std::nullopt;
  LayoutRequest make = MakingOf(request, cost);
  if (earlier != nullptr) make.earlier = &earlier->partition;
  auto made = std::make_shared<const Layout>(MakeLayout(make));
  if (request.stop.stop_requested()) return nullptr;

  lock.lock();
  if (const Entry* found = entries_.Find(key)) return found->layout;  // another thread was quicker
  entries_.Put(key, {.layout = made, .by_cost = cost.has_value()});
  entries_.DropBeyond(kMaxKept);
  return made;
}

LayoutRequest LayoutTable::MakingOf(const Request& request, const std::optional<WorkField>& cost) {
  return {.summary = request.summary,
          .volume = request.volume,
          .policy = request.policy,
          .slots = request.slots,
          .hosts = request.hosts,
          .box_bytes_target = request.box_bytes_target,
          .map = request.map.get(),
          .coarser = request.coarser,
          .known = {.occupied = request.occupied.get(), .cost = cost ? &*cost : nullptr},
          .stop = request.stop};
}

bool LayoutTable::HasMade(const Request& request) {
  Key key = KeyOf(request);
  const std::unique_lock lock(mutex_, std::try_to_lock);
  return lock && std::ranges::any_of(entries_.entries(), [&](const auto& entry) {
           key.box_bytes_target = entry.key.box_bytes_target;
           return entry.key == key;
         });
}

std::shared_ptr<const Layout> LayoutTable::FindMade(const Request& request) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return nullptr;
  const Entry* const found = entries_.Find(KeyOf(request));
  return found == nullptr ? nullptr : found->layout;
}

void LayoutTable::Learn(const Request& request, const FramePlan& plan, std::span<const RankReport> reports) {
  const Key key = KeyOf(request);
  if (LearnCosts(request, key, plan, reports) && request.occupied != nullptr) ChangeLayout(request, key);
}

bool LayoutTable::LearnCosts(const Request& request, const Key& key, const FramePlan& plan, std::span<const RankReport> reports) {
  const std::map<BoxId, double> seconds = SecondsOf(*plan.layout, reports);
  if (seconds.empty()) return false;
  const std::lock_guard lock(mutex_);
  Learnt* const learnt = learnt_.Find(key.volume);
  if (learnt == nullptr) return false;
  Entry* const entry = entries_.Find(key);
  const bool present = entry != nullptr && (entry->layout == plan.layout || *entry->layout == *plan.layout);
  // The first frame of a layout counts most; a frame of a layout that has been changed since counts as an average one.
  double weight = kLeastWeight;
  if (present) {
    weight = std::max(weight, 1.0 / ++entry->frames_seen);
    entry->seconds.resize(plan.layout->owners.size());
  }
  std::vector<BoxSeconds> boxes;
  std::vector<double> deviations;
  for (const auto& [box, time] : seconds) {
    boxes.push_back({plan.layout->partition.boxes()[box], time});
    if (!present) continue;
    double& known = entry->seconds[box];
    if (known > 0) deviations.push_back(time / known - 1);
    known = known == 0 ? time : known + weight * (time - known);
  }
  static_assert(kMostFramesAveraged == int((2 - kLeastWeight) / kLeastWeight + 0.5), "the mean's variance over that of a frame");
  if (!deviations.empty()) learnt->noise.Learn(deviations, std::clamp(entry->frames_seen - 1, 1, kMostFramesAveraged));
  learnt->cost.Learn(boxes, weight);
  if (!present) return false;
  if (entry->frames_seen == 1) {
    const MoveSeconds seen = MoveSecondsOf(*plan.layout, std::int64_t(BytesPerSample(request.summary->description.type)), reports);
    Follow(learnt->move.fetch, seen.fetch);
    Follow(learnt->move.prepare, seen.prepare);
  }
  std::vector<double> of_frame(plan.layout->owners.size());
  for (const auto& [box, time] : seconds) of_frame[box] = time;
  entry->lost += LostSeconds(*plan.layout, request.slots, of_frame);
  return true;
}

void LayoutTable::ChangeLayout(const Request& request, const Key& key) {
  const ResolvedPolicy& policy = *request.policy;
  std::shared_ptr<const Layout> present;
  std::vector<double> seconds;
  BalanceRequest balanced;
  {
    const std::lock_guard lock(mutex_);
    const Learnt* const learnt = learnt_.Find(key.volume);
    Entry* const entry = entries_.Find(key);
    if (learnt == nullptr || entry == nullptr || entry->frames_seen == 0) return;
    const bool make_by_cost = policy.balance_by == BalanceBy::kCost && !entry->by_cost;
    if (policy.balance->change == nullptr && !make_by_cost) return;
    // To weigh a change takes milliseconds. It is done each time that the seconds lost since the layout was made have grown by half.
    constexpr double kLookAgain = 1.5;
    if (policy.balance->weighs && entry->lost <= kLookAgain * entry->lost_at_look) return;
    entry->lost_at_look = entry->lost;
    present = entry->layout;
    seconds = entry->seconds;
    balanced.frames_seen = entry->frames_seen;
    balanced.noise = learnt->noise.deviation();
    balanced.move = learnt->move;
  }
  const std::optional<WorkField> cost = KnownCost(key.volume);
  if (!cost) return;  // what was known was dropped meanwhile
  const LayoutRequest make = MakingOf(request, cost);
  balanced.now = present.get();
  balanced.seconds = seconds;
  balanced.make = &make;
  std::optional<Layout> made = policy.balance->change != nullptr ? policy.balance->change(balanced) : MakeLayout(make);

  const std::lock_guard lock(mutex_);
  Entry* const entry = entries_.Find(key);
  if (entry == nullptr || entry->layout != present) return;  // another thread was quicker
  entry->by_cost = true;
  if (!made || *made == *present) return;
  entry->layout = std::make_shared<const Layout>(*std::move(made));
  entry->frames_seen = 0;
  entry->seconds.clear();
  entry->lost = entry->lost_at_look = 0;
}

}  // namespace slabstream

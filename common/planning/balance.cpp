#include "common/planning/balance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "common/base/check.h"
#include "common/calibration/calibration.h"
#include "common/view/sheet_grid.h"
#include "common/volume/box_assembly.h"

namespace slabstream {
namespace {

constexpr double kLasts = 2;                  // times as long as a layout has lasted it is taken to last
constexpr double kLeastGain = 0.02;           // share of the frame's render time that a change must save, however certain it is
constexpr double kLeastGainOfNewBoxes = 0.1;  // share of the frame's render time that new boxes must save beyond resized ones

std::vector<double> SlotSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds) {
  CHECK_EQ(seconds.size(), layout.owners.size());
  std::vector<double> sums(slots);
  for (std::size_t box = 0; box < seconds.size(); ++box) {
    if (layout.owners[box] != kNoSlot) sums[layout.owners[box]] += seconds[box];
  }
  return sums;
}

}  // namespace

std::vector<double> PredictedSeconds(const Layout& layout, const WorkField& cost) {
  std::vector<double> seconds(layout.owners.size());
  for (std::size_t box = 0; box < seconds.size(); ++box) {
    if (layout.owners[box] != kNoSlot) seconds[box] = cost.Sum(layout.partition.boxes()[box]);
  }
  return seconds;
}

double FrameSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds) {
  const std::vector<double> sums = SlotSeconds(layout, slots, seconds);
  return *std::max_element(sums.begin(), sums.end());
}

double LostSeconds(const Layout& layout, std::uint32_t slots, std::span<const double> seconds) {
  const std::vector<double> sums = SlotSeconds(layout, slots, seconds);
  return *std::max_element(sums.begin(), sums.end()) - std::accumulate(sums.begin(), sums.end(), 0.0) / double(slots);
}

std::int64_t MovedVoxels(const Layout& from, const Layout& to) {
  const auto with_halo = [](const Layout& layout, std::size_t box) {
    return Grown(layout.partition.boxes()[box], kHalo, layout.partition.bounds());
  };
  std::map<std::uint32_t, std::vector<Box>> held;  // by slot
  for (std::size_t box = 0; box < from.owners.size(); ++box) {
    if (from.owners[box] != kNoSlot) held[from.owners[box]].push_back(with_halo(from, box));
  }
  std::int64_t moved = 0;
  for (std::size_t box = 0; box < to.owners.size(); ++box) {
    if (to.owners[box] == kNoSlot) continue;
    const Box wanted = with_halo(to, box);
    moved += Assemble(wanted, held[to.owners[box]], MostMissing(wanted)).missing_voxels();
  }
  return moved;
}

Layout Reassign(const Layout& layout, std::uint32_t slots, std::span<const double> seconds) {
  Layout changed = layout;
  std::vector<double> sums = SlotSeconds(layout, slots, seconds);
  for (std::size_t moves = 0; moves < seconds.size(); ++moves) {
    const auto most = std::max_element(sums.begin(), sums.end()), least = std::min_element(sums.begin(), sums.end());
    // The box that makes the two slots most alike; it must take less than their difference.
    const double half = (*most - *least) / 2;
    std::optional<std::size_t> best;
    for (std::size_t box = 0; box < seconds.size(); ++box) {
      if (changed.owners[box] != std::uint32_t(most - sums.begin()) || seconds[box] <= 0 || seconds[box] >= 2 * half) continue;
      if (!best || std::abs(seconds[box] - half) < std::abs(seconds[*best] - half)) best = box;
    }
    if (!best) break;
    changed.owners[*best] = std::uint32_t(least - sums.begin());
    *most -= seconds[*best];
    *least += seconds[*best];
  }
  return changed;
}

Layout CutByCost(const LayoutRequest& request, const Partition* resized) {
  ResolvedPolicy by_cost = *request.policy;
  by_cost.balance_by = BalanceBy::kCost;
  LayoutRequest cut = request;
  cut.policy = &by_cost;
  cut.resized = resized;
  return MakeLayout(cut);
}

double ChangeSeconds(const BalanceRequest& request, const Layout& to) {
  const Layout& from = *request.now;
  std::set<std::pair<std::uint32_t, Box>> present;
  for (std::size_t box = 0; box < from.owners.size(); ++box) present.emplace(from.owners[box], from.partition.boxes()[box]);
  std::vector<double> prepared(request.make->slots);  // voxels of new boxes
  for (std::size_t box = 0; box < to.owners.size(); ++box) {
    const Box& voxels = to.partition.boxes()[box];
    if (to.owners[box] == kNoSlot || present.contains({to.owners[box], voxels})) continue;
    prepared[to.owners[box]] += double(voxels.voxel_count());
  }
  const double by_rate = double(BytesPerSample(request.make->summary->description.type)) / calibration::service::kVoxelRate;
  return double(MovedVoxels(from, to)) * request.move.fetch.value_or(by_rate) +
         std::ranges::max(prepared) * request.move.prepare.value_or(0);
}

std::optional<Layout> Rebalance(const BalanceRequest& asked) {
  if (!asked.noise) return std::nullopt;
  const Layout& now = *asked.now;
  const LayoutRequest& request = *asked.make;
  CHECK(request.known.cost != nullptr);
  CHECK_GE(asked.frames_seen, 1);
  const double frames = std::min(asked.frames_seen, kMostFramesAveraged);
  const double by_chance = *asked.noise * std::sqrt(2 * std::log(std::max(request.slots, 2U)) / frames);
  const double least_gain = std::max(kLeastGain, by_chance);
  const double busiest = FrameSeconds(now, request.slots, asked.seconds);
  // No layout saves more than what is lost now.
  if (LostSeconds(now, request.slots, asked.seconds) <= least_gain * busiest) return std::nullopt;

  std::optional<Layout> chosen;
  double most_won = 0;
  const auto weigh = [&](Layout candidate, double before, double after) {
    if (before - after <= least_gain * before) return;
    const double won = kLasts * asked.frames_seen * (before - after) - ChangeSeconds(asked, candidate);
    if (won <= most_won) return;
    most_won = won;
    chosen = std::move(candidate);
  };

  Layout reassigned = Reassign(now, request.slots, asked.seconds);
  const double after_reassigning = FrameSeconds(reassigned, request.slots, asked.seconds);
  weigh(std::move(reassigned), busiest, after_reassigning);

  const auto predicted = [&](const Layout& layout) {
    return FrameSeconds(layout, request.slots, PredictedSeconds(layout, *request.known.cost));
  };
  const double before = predicted(now);
  Layout cut_anew = CutByCost(request, nullptr);
  const double after_cut = predicted(cut_anew);
  Layout resized = CutByCost(request, &now.partition);
  const double after_resizing = predicted(resized);
  weigh(std::move(resized), before, after_resizing);
  if (after_cut < (1 - kLeastGainOfNewBoxes) * after_resizing) weigh(std::move(cut_anew), before, after_cut);
  return chosen;
}

}  // namespace slabstream
